"""What the floor is made of at a place: sliding friction and rolling resistance, by working areas. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.schema import World


@dataclass(frozen=True)
class Floor:
    """A bare floor, number 0, and k rectangular patches 1..k along the axes; a later patch lies on earlier ones."""

    low: np.ndarray  # (k, 2) lower left corners [m]
    high: np.ndarray  # (k, 2) upper right corners [m]
    friction: np.ndarray  # (k + 1,) sliding friction against the wheels [-]
    rolling_resistance: np.ndarray  # (k + 1,) force that resists rolling, per force that presses down [-]

    def area(self, points: np.ndarray) -> np.ndarray:
        """Return the number (...,) of the uppermost area at each of `points` (..., 2) [m]; edges belong to patches."""
        at = points[..., None, :]
        within = ((self.low <= at) & (at <= self.high)).all(axis=-1)  # (..., k)
        return (within * np.arange(1, len(self.low) + 1)).max(axis=-1, initial=0)


def floor_of(world: World) -> Floor:
    """Return the floor of a scenario's section `world`."""
    corners = np.array([[patch.start, patch.end] for patch in world.patches], dtype=float).reshape(-1, 2, 2)
    areas = (world, *world.patches)
    return Floor(
        low=corners.min(axis=1),
        high=corners.max(axis=1),
        friction=np.array([world.floor_friction, *(patch.friction for patch in world.patches)]),
        rolling_resistance=np.array([area.rolling_resistance for area in areas]),
    )
