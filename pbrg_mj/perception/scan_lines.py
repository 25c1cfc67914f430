"""One scan to the straight walls it shows, in the body frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.rules import LineRules
from pbrg_mj.perception.setup import SegmentRules
from pbrg_mj.perception.walls import find_walls


@dataclass(frozen=True)
class Lines:
    """L straight walls n . p = offset in the frame of the beams, longest first; n = (cos angle, sin angle)."""

    angle: np.ndarray  # (L,) direction of the outward normal n [rad]
    offset: np.ndarray  # (L,) distance of the origin, >= 0 [m]
    covariance: np.ndarray  # (L, 2, 2) of (angle, offset) from range noise
    low: np.ndarray  # (L,) where the stretch seen begins along t = (-sin, cos) [m]
    high: np.ndarray  # (L,) where it ends [m]
    free_low: np.ndarray  # (L,) bool: the wall truly ends at `low`, beams pass by it there
    free_high: np.ndarray  # (L,) bool: the same at `high`

    def __len__(self) -> int:
        """Return L."""
        return len(self.angle)


def scan_lines(ranges: np.ndarray, directions: np.ndarray, rules: LineRules) -> Lines:
    """Return the walls of one scan: ranges (beams,) [m], NaN for no hit; directions (beams, 2) unit vectors.

    The beams are in counter-clockwise order, evenly spread. Anything in a scan is allowed: what is no wall gives
    no line.
    """
    split = max(rules.split_distance, 4 * rules.range_std)
    found = find_walls(ranges, directions, SegmentRules(rules.range_std, split, rules.min_points, rules.min_length))
    nobody = np.zeros(len(found), dtype=bool)
    return Lines(
        angle=np.array([line.angle for line in found]),
        offset=np.array([line.offset for line in found]),
        covariance=np.array([line.covariance for line in found]).reshape(-1, 2, 2),
        low=np.array([line.along.min() for line in found]),
        high=np.array([line.along.max() for line in found]),
        free_low=nobody,
        free_high=nobody.copy(),
    )
