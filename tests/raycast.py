"""The ray-caster, where tests look for it."""

from scripts.accuracy.raycast import Scene, cast, moved_pose

__all__ = ["Scene", "cast", "moved_pose"]
