"""The ray-caster, where tests look for it."""

from scripts.accuracy.raycast import (
    PLATE,
    TUB,
    WHEEL,
    WHEELS,
    WHEELS_TOP,
    Scene,
    cast,
    cast_along,
    moved_pose,
    robot,
    wheels,
)

__all__ = [
    "PLATE",
    "TUB",
    "WHEEL",
    "WHEELS",
    "WHEELS_TOP",
    "Scene",
    "cast",
    "cast_along",
    "moved_pose",
    "robot",
    "wheels",
]
