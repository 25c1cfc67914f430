"""Echoes that are lost because too little light comes back.

A diffuse (Lambertian) surface sends back a power in proportion to its reflectance, to the cosine of the angle of
incidence and to the inverse square of the range. The data sheet of ST's VL53L1X agrees: 3.6 m on white targets (0.88 of
the light) and 1.7 m on dark ones (0.17), of which the law makes 1.6 m. Surfaces whose scenario says nothing are white.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from pbrg_mj.scenario.schema import WHITE


class SignalStrength(NamedTuple):
    """How much power an echo takes."""

    range: float  # at which a white wall head-on gives an echo every other time [m]
    spread: float  # standard deviation of the power, relative [-]


def relative_power(
    ranges: np.ndarray, cosines: np.ndarray, reflectance: float | np.ndarray, signal: SignalStrength
) -> np.ndarray:
    """Return the power that comes back, against the least that makes an echo [-]."""
    safe = np.maximum(ranges, 1e-6)
    return reflectance / WHITE * cosines * (signal.range / safe) ** 2


def echo_probability(power: np.ndarray, signal: SignalStrength) -> np.ndarray:
    """Return how likely an echo is: that the power times 1 + N(0, spread) is 1 or more."""
    with np.errstate(divide="ignore"):
        missing = 1.0 / np.maximum(power, 1e-300) - 1.0
    return ndtr(-missing / signal.spread) if signal.spread > 0 else (power >= 1.0).astype(float)
