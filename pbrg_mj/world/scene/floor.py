"""The floor by working areas: its sliding friction and rolling resistance at a point, and its patches as geoms."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import World

_THICKNESS = 2e-4  # of a patch's picture [m]; patches collide with nothing


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


def add_patches(spec: mujoco.MjSpec, world: World) -> None:
    """Draw the patches on the floor, a later one above earlier ones; brownish where wheels roll harder, else bluish."""
    floor = floor_of(world)
    for k, (low, high) in enumerate(zip(floor.low, floor.high, strict=True)):
        rougher = floor.rolling_resistance[k + 1] > floor.rolling_resistance[0]
        spec.worldbody.add_geom(
            name=f"patch{k}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[*(high - low) / 2, _THICKNESS * (k + 1) / 2],
            pos=[*(low + high) / 2, _THICKNESS * (k + 1) / 2],
            rgba=[0.72, 0.60, 0.45, 1] if rougher else [0.62, 0.74, 0.86, 1],
            contype=0,
            conaffinity=0,
        )
