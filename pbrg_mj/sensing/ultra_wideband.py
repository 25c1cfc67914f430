"""Places by radio ranges to anchors, with the late tail of ultra-wideband.

A range is Gaussian in line of sight; where the direct path is lost, an exponential error comes on top, always too long:
G. Bellusci et al., "Modeling distance and bandwidth dependency of TOA-based UWB ranging error for positioning",
Research Letters in Communications, 2009.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.scenario.schema.localization import UltraWideband

STEPS = 8  # of Gauss and Newton, from amid the anchors


class Radio(NamedTuple):
    """Anchors and errors of the ranges to them."""

    anchors: np.ndarray  # (a, 2) [m]
    range_std: float  # [m]
    late_share: float
    late_mean: float  # [m]


def radio_of(uwb: UltraWideband) -> Radio:
    """Return the radio of a scenario that has anchors."""
    return Radio(np.array(uwb.anchors), uwb.range_std, uwb.late_share, uwb.late_mean)


def measured_ranges(place: np.ndarray, radio: Radio, random: np.random.Generator) -> np.ndarray:
    """Return the ranges (a,) [m] from a true place (2,) [m]; all numbers are drawn, whatever the shares."""
    true = np.linalg.norm(radio.anchors - place, axis=1)
    normal, lost, late = (
        random.standard_normal(len(true)),
        random.random(len(true)),
        random.standard_exponential(len(true)),
    )
    return true + radio.range_std * normal + np.where(lost < radio.late_share, radio.late_mean * late, 0.0)


def place_of(ranges: np.ndarray, anchors: np.ndarray) -> np.ndarray:
    """Return the place (2,) [m] whose distances from the anchors (a, 2) are nearest to `ranges` (a,) in squares."""
    place = anchors.mean(axis=0)
    for _ in range(STEPS):
        ray = place - anchors
        distance = np.maximum(np.linalg.norm(ray, axis=1), 1e-9)
        step, *_ = np.linalg.lstsq(ray / distance[:, None], ranges - distance, rcond=None)
        place = place + step
    return place
