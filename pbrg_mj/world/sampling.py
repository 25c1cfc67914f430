"""When a sensor with a rate of its own takes its samples, in whole numbers."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

# MuJoCo adds up periods and time steps in floating point, and a rounding error could make a sample one step late.
# Periods this much short keep every sum on the early side, for hours of simulated time, and cost 1 ns per second.
_SHORTENED = 1 - 1e-9


@dataclass(frozen=True)
class Sampler:
    """Sample k is taken at the first physics step at or after k / rate_hz; every step if the rate is above that."""

    rate_hz: float
    physics_step: float  # [s]

    @property
    def every_step(self) -> bool:
        """Whether each physics step brings a new sample."""
        return self._samples_per_step >= 1

    @property
    def interval(self) -> float:
        """MuJoCo's `interval` of the sensor [s]; 0 for every step."""
        return 0.0 if self.every_step else _SHORTENED / self.rate_hz

    def frame(self, step: int) -> int:
        """Return the number of the sample that is held at physics step `step` (0 at the start)."""
        return step if self.every_step else int(step * self._samples_per_step)

    @property
    def _samples_per_step(self) -> Fraction:
        # By way of the shortest decimals: 0.002 s means two milliseconds, not the nearest binary fraction.
        return Fraction(repr(float(self.rate_hz))) * Fraction(repr(float(self.physics_step)))
