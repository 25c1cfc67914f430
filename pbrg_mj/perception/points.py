"""A scan as points in the body frame, in the order of the beams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Points:
    """The N beams of one scan that hit something, counter-clockwise."""

    beam: np.ndarray  # (N,) number of the beam
    direction: np.ndarray  # (N, 2) unit vector of the beam in the body frame
    range: np.ndarray  # (N,) [m]
    xy_body: np.ndarray  # (N, 2) [m]
    beams: int  # of the whole circle

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.beam)

    def take(self, index: np.ndarray | slice) -> Points:
        """Return the points at `index`, in that order."""
        return Points(self.beam[index], self.direction[index], self.range[index], self.xy_body[index], self.beams)

    def append(self, other: Points) -> Points:
        """Return these points and then the other's."""
        return Points(
            np.concatenate([self.beam, other.beam]),
            np.concatenate([self.direction, other.direction]),
            np.concatenate([self.range, other.range]),
            np.concatenate([self.xy_body, other.xy_body]),
            self.beams,
        )


def scan_points(ranges: np.ndarray, directions: np.ndarray) -> Points:
    """Return the points of one scan: ranges (beams,) [m], NaN where nothing was hit; directions (beams, 2)."""
    beam = np.flatnonzero(np.isfinite(ranges))
    direction, hit = directions[beam], ranges[beam]
    return Points(beam, direction, hit, hit[:, None] * direction, len(ranges))
