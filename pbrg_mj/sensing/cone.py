"""A beam that is a cone: it tells of the nearest thing in its view, wherever in the view that is.

Time-of-flight modules see so: 27 degrees by the data sheet of ST's VL53L1X, 25 of the VL53L0X. A cone is a fan of rays
here, level with the beam.
"""

from __future__ import annotations

import numpy as np


def nearest_in_cones(ranges: np.ndarray, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the ranges (R, beams) [m] of the nearest things, and which ray each is of (R, beams).

    `ranges` (R, beams * rays) [m], a cone's rays side by side, -1 where nothing was hit; -1 likewise where no ray of a
    cone hit anything.
    """
    cones = _by_cone(ranges, rays)
    hit = np.where(cones >= 0, cones, np.inf)
    which = np.argmin(hit, axis=2)
    return np.take_along_axis(cones, which[..., None], axis=2)[..., 0], which


def values_of_rays(values: np.ndarray, which: np.ndarray, rays: int) -> np.ndarray:
    """Return what belongs to the nearest rays (R, beams), of values of all rays (R, beams * rays)."""
    return np.take_along_axis(_by_cone(values, rays), which[..., None], axis=2)[..., 0]


def _by_cone(values: np.ndarray, rays: int) -> np.ndarray:
    """Return values of all rays (R, beams, rays); nobody may have beams."""
    robots, all_rays = values.shape
    return values.reshape(robots, all_rays // rays, rays)
