"""Echoes that bind, and how far a hand point must stay from each along a direction, as our half-spaces take it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.perception.points.obstacle_points import ObstaclePoints
from pbrg_mj.perception.points.parameters import PointParameters


class Places(NamedTuple):
    """Echoes that bind."""

    at: np.ndarray  # (k, 2) [m]
    points: np.ndarray  # (k,) of POINT
    widest: np.ndarray  # (k,) inset in the worst direction, without the range's deviation [m]
    std: np.ndarray  # (k,) of the range [m]
    clearance: float  # [m]
    sigmas: float

    def insets(self, normals: np.ndarray) -> np.ndarray:
        """Return how far (k, m) [m] the hand point must stay along unit vectors (m, 2), each range by itself."""
        point = {name: self.points[name][:, None] for name in self.points.dtype.names or ()}
        gx, gy = normals.T
        ahead, aside = gx * point["ux"] + gy * point["uy"], gx * point["uy"] - gy * point["ux"]
        turn = point["turn_std"] ** 2
        pose = np.sqrt(np.maximum(point["pose_std"] ** 2 - turn, 0.0) + turn * aside**2)
        corner = np.minimum(point["protrusion"], np.abs(gx * point["along_x"] + gy * point["along_y"]) + point["slack"])
        inset = np.minimum(self.clearance + self.sigmas * pose + corner, self.widest[:, None])
        return inset + self.sigmas * self.std[:, None] * np.minimum(np.abs(ahead), 1.0)

    def some(self, which: np.ndarray) -> Places:
        """Return some of the places, by their indices."""
        return self._replace(
            at=self.at[which], points=self.points[which], widest=self.widest[which], std=self.std[which]
        )


def places_of(found: ObstaclePoints, count: int, parameters: PointParameters) -> Places:
    """Return the first places of what the estimator has."""
    return Places(
        np.column_stack([found.x, found.y])[:count],
        found.memory[found.point[:count]],
        found.inset[:count].copy(),
        found.std[:count].copy(),
        parameters.clearance,
        parameters.sigmas,
    )
