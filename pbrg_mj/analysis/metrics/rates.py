"""Rates of what happened or did not, with confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rate:
    """How often something happened, and Wilson's interval of its probability.

    E. B. Wilson, Probable inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22 (1927).
    """

    count: int
    trials: int  # 1 or more
    low: float  # of the interval [-]
    high: float

    @classmethod
    def of(cls, count: int, trials: int, confidence: float = CONFIDENCE) -> Rate:
        """Return the rate of `count` in `trials` independent trials; the interval is two-sided."""
        z = NormalDist().inv_cdf((1 + confidence) / 2)
        share, spread = count / trials, z**2 / trials
        centre = share + spread / 2
        half = math.sqrt(share * (1 - share) * spread + spread**2 / 4)
        low, high = ((centre + side * half) / (1 + spread) for side in (-1, 1))
        return cls(count, trials, 0.0 if count == 0 else low, 1.0 if count == trials else high)

    @property
    def share(self) -> float:
        """The count over the trials."""
        return self.count / self.trials

    def as_dict(self) -> dict[str, float]:
        """Return share and interval."""
        return {"share": self.share, "low": self.low, "high": self.high}
