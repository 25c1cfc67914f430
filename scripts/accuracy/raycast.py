"""An analytic ray-caster over segments and discs: the oracle behind perception's tests and accuracy figures."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

PLATE, TUB, WHEEL = 0.06, 0.043, 0.02  # radii of models/robot.xml [m]
WHEELS = ((0.045, 0.055), (-0.045, -0.055))  # faces of its wheels to the left of its centre, inner and outer [m]
WHEELS_TOP = 0.04  # above the floor [m]


@dataclass(frozen=True)
class Scene:
    """Segments (x0, y0, x1, y1) and discs (x, y, radius) in the world [m]."""

    segments: tuple[tuple[float, float, float, float], ...] = ()
    discs: tuple[tuple[float, float, float], ...] = ()

    def __add__(self, other: "Scene") -> "Scene":
        """Both scenes in one."""
        return Scene(self.segments + other.segments, self.discs + other.discs)

    def moved(self, x: float, y: float, angle: float) -> "Scene":
        """The scene turned by `angle` [rad] about the origin, then shifted."""

        def place(px: float, py: float) -> tuple[float, float]:
            c, s = np.cos(angle), np.sin(angle)
            return float(c * px - s * py + x), float(s * px + c * py + y)

        return Scene(
            tuple((*place(a, b), *place(c, d)) for a, b, c, d in self.segments),
            tuple((*place(a, b), radius) for a, b, radius in self.discs),
        )


def robot(pose: np.ndarray, height: float) -> Scene:
    """What beams at a height [m] meet of a robot at `pose` (3,): its plate, or its tub and wheels."""
    if height > WHEELS_TOP:
        return Scene((), ((0.0, 0.0, PLATE),)).moved(*pose)
    return Scene((), ((0.0, 0.0, TUB),)).moved(*pose) + wheels(pose, height)


def wheels(pose: np.ndarray, height: float) -> Scene:
    """The wheels of a robot, without their spokes: rectangles as long as a wheel is at that height. All of its own."""
    if height > WHEELS_TOP:
        return Scene()
    half = float(np.sqrt(WHEEL**2 - (height - WHEEL) ** 2))
    corners = (((-half, a), (half, a), (half, b), (-half, b), (-half, a)) for a, b in WHEELS)
    return Scene(tuple((*a, *b) for ring in corners for a, b in pairwise(ring))).moved(*pose)


def moved_pose(pose: np.ndarray, x: float, y: float, angle: float) -> np.ndarray:
    """A pose (3,) moved like `Scene.moved`."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * pose[0] - s * pose[1] + x, s * pose[0] + c * pose[1] + y, pose[2] + angle])


def cast(scene: Scene, pose: np.ndarray, beams: int, range_max: float = 4.0) -> np.ndarray:
    """Exact ranges (beams,) [m] from `pose` (3,), beam b at heading + 2 pi b / beams; NaN for no hit."""
    return cast_along(scene, pose, 2 * np.pi * np.arange(beams) / beams, range_max)


def cast_along(scene: Scene, pose: np.ndarray, angles: np.ndarray, range_max: float = 4.0) -> np.ndarray:
    """Exact ranges (beams,) [m] from `pose` (3,), beams at angles (beams,) [rad] from the heading; NaN for no hit."""
    angle = pose[2] + angles
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    nearest = np.full(len(angles), np.inf)
    if scene.segments:
        nearest = _segments(np.array(scene.segments), pose[:2], direction).min(axis=0)
    for disc in scene.discs:
        nearest = np.minimum(nearest, _disc(np.array(disc), pose[:2], direction))
    return np.where(nearest < range_max, nearest, np.nan)


def _segments(segments: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the distances (S, beams) [m] of segments (S, 4), inf for a miss."""
    (x, y), (dx, dy) = (segments[:, :2] - origin).T[..., None], (segments[:, 2:] - segments[:, :2]).T[..., None]
    cross = direction[:, 0] * dy - direction[:, 1] * dx
    parallel = np.abs(cross) < 1e-15
    safe = np.where(parallel, 1.0, cross)
    distance = (x * dy - y * dx) / safe
    where = (x * direction[:, 1] - y * direction[:, 0]) / safe
    hit = ~parallel & (distance > 0) & (where >= 0) & (where <= 1)
    return np.where(hit, distance, np.inf)


def _disc(disc: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    middle = direction @ (disc[:2] - origin)
    off = np.sum((disc[:2] - origin) ** 2) - middle**2
    inside = disc[2] ** 2 - off
    distance = middle - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside >= 0) & (distance > 0), distance, np.inf)
