"""Numbers of many runs in few: quartiles, shifted geometric means, paired differences with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pbrg_mj.analysis.metrics.rates import CONFIDENCE


@dataclass(frozen=True)
class Quartiles:
    """Median and quartiles, by linear interpolation between order statistics."""

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Quartiles | None:
        """Return them; None of no values."""
        return cls(*map(float, np.percentile(values, [25, 50, 75]))) if len(values) else None


@dataclass(frozen=True)
class Difference:
    """Mean of paired differences, and Student's interval of the mean behind them."""

    mean: float
    low: float  # of the interval; -inf of a single pair
    high: float
    pairs: int

    @classmethod
    def of(cls, differences: Sequence[float]) -> Difference | None:
        """Return it; None of no pairs. The interval is two-sided and exact for normal differences."""
        n = len(differences)
        if n == 0:
            return None
        mean = math.fsum(differences) / n
        if n == 1:
            return cls(mean, -math.inf, math.inf, 1)
        from scipy.special import stdtrit

        deviation = math.sqrt(math.fsum((one - mean) ** 2 for one in differences) / (n - 1) / n)
        half = float(stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * deviation
        return cls(mean, mean - half, mean + half, n)


def shifted_geometric_mean(values: Sequence[float], shift: float) -> float | None:
    """Return (prod_k (v_k + shift))^(1/K) - shift of values of 0 or more, shift > 0; None of no values.

    The shift keeps values near 0 from outweighing all others (T. Achterberg, Constraint integer programming, 2007).
    """
    if not len(values):
        return None
    return shift * math.expm1(math.fsum(math.log1p(value / shift) for value in values) / len(values))
