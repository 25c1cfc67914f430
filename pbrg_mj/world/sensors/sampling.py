"""When sensors with a rate of their own take samples, in whole physics steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from pbrg_mj.world.physics_steps import exact, steps_until

# MuJoCo adds up periods and time steps in floating point, and a rounding error could make a sample one step late.
# Periods this much short keep every sum on the early side, for hours of simulated time, and cost 1 ns per second.
_SHORTENED = 1 - 1e-9
_SHORT_OF_A_STEP = 1e-6


@dataclass(frozen=True)
class Sampler:
    """Sample k is taken at the first physics step at or after k / rate_hz; every step if the rate is above that.

    It is held from the first step at or after `delay` later. Until the first one arrives it counts as held already:
    whoever uses the sensor knows how things stand at the start.
    """

    rate_hz: float
    physics_step: float  # [s]
    delay: float = 0.0  # from taking a sample to holding it [s]

    @cached_property
    def every_step(self) -> bool:
        """Whether each physics step brings a new sample."""
        return self._samples_per_step >= 1

    @property
    def interval(self) -> float:
        """MuJoCo's `interval` of the sensor [s]; 0 for every step."""
        return 0.0 if self.every_step else _SHORTENED / self.rate_hz

    @cached_property
    def delay_steps(self) -> int:
        """The delay in whole physics steps, rounded up."""
        return steps_until(self.delay, self.physics_step)

    @property
    def native_delay(self) -> float:
        """MuJoCo's `delay` of the sensor [s]: short of whole steps, so that no rounding error makes it one more."""
        return (self.delay_steps - _SHORT_OF_A_STEP) * self.physics_step if self.delay_steps else 0.0

    @property
    def history(self) -> int:
        """MuJoCo's `nsample`: how many samples to keep so that the delayed one is among them."""
        samples = self.delay_steps * min(self._samples_per_step, Fraction(1))
        return math.ceil(samples) + 2 if samples else 1

    @property
    def sensor_options(self) -> dict:
        """MuJoCo's options of a sensor that is sampled like this; none where every step brings a sample at once."""
        period = {} if self.every_step else {"interval": [self.interval, 0.0]}
        delay = {"delay": self.native_delay} if self.delay else {}
        return {"nsample": self.history, **period, **delay} if period or delay else {}

    def options_before(self, early: float) -> dict:
        """Return the same for a sensor whose samples are taken `early` [s], less than a period, before each frame.

        The first is the one before frame 1.
        """
        options = self.sensor_options
        return {**options, "interval": [self.interval, -early]} if early > 0 and self.interval > 0 else options

    def frame(self, step: int) -> int:
        """Return the number of the sample that is held at physics step `step` (0 at the start)."""
        return self.newest(max(step - self.delay_steps, 0))

    def newest(self, step: int) -> int:
        """Return the number of the newest sample that is taken at or before physics step `step`."""
        samples, steps = self._ratio
        return min(step, step * samples // steps)

    def held_until(self, frame: int) -> int:
        """Return the physics step from which sample `frame` is not held any more."""
        return self.step(frame + 1) + self.delay_steps

    def step(self, frame: int) -> int:
        """Return the physics step at which sample `frame` is taken."""
        samples, steps = self._ratio
        return frame if self.every_step else -(-frame * steps // samples)  # rounded up

    @cached_property
    def _ratio(self) -> tuple[int, int]:
        return self._samples_per_step.as_integer_ratio()

    @cached_property
    def _samples_per_step(self) -> Fraction:
        return exact(self.rate_hz) * exact(self.physics_step)
