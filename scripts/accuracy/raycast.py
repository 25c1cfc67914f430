"""An analytic ray-caster over segments and discs: the oracle behind perception's tests and accuracy figures."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scene:
    """Segments (x0, y0, x1, y1) and discs (x, y, radius) in the world [m]."""

    segments: tuple[tuple[float, float, float, float], ...] = ()
    discs: tuple[tuple[float, float, float], ...] = ()

    def moved(self, x: float, y: float, angle: float) -> "Scene":
        """The scene turned by `angle` [rad] about the origin, then shifted."""

        def place(px: float, py: float) -> tuple[float, float]:
            c, s = np.cos(angle), np.sin(angle)
            return float(c * px - s * py + x), float(s * px + c * py + y)

        return Scene(
            tuple((*place(a, b), *place(c, d)) for a, b, c, d in self.segments),
            tuple((*place(a, b), radius) for a, b, radius in self.discs),
        )


def moved_pose(pose: np.ndarray, x: float, y: float, angle: float) -> np.ndarray:
    """A pose (3,) moved like `Scene.moved`."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * pose[0] - s * pose[1] + x, s * pose[0] + c * pose[1] + y, pose[2] + angle])


def cast(scene: Scene, pose: np.ndarray, beams: int, range_max: float = 4.0) -> np.ndarray:
    """Exact ranges (beams,) [m] from `pose` (3,), beam b at heading + 2 pi b / beams; NaN for no hit."""
    angle = pose[2] + 2 * np.pi * np.arange(beams) / beams
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    nearest = np.full(beams, np.inf)
    for segment in scene.segments:
        nearest = np.minimum(nearest, _segment(np.array(segment), pose[:2], direction))
    for disc in scene.discs:
        nearest = np.minimum(nearest, _disc(np.array(disc), pose[:2], direction))
    return np.where(nearest < range_max, nearest, np.nan)


def _segment(segment: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    start, along = segment[:2] - origin, segment[2:] - segment[:2]
    cross = direction[:, 0] * along[1] - direction[:, 1] * along[0]
    parallel = np.abs(cross) < 1e-15
    safe = np.where(parallel, 1.0, cross)
    distance = (start[0] * along[1] - start[1] * along[0]) / safe
    where = (start[0] * direction[:, 1] - start[1] * direction[:, 0]) / safe
    hit = ~parallel & (distance > 0) & (where >= 0) & (where <= 1)
    return np.where(hit, distance, np.inf)


def _disc(disc: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    middle = direction @ (disc[:2] - origin)
    off = np.sum((disc[:2] - origin) ** 2) - middle**2
    inside = disc[2] ** 2 - off
    distance = middle - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside >= 0) & (distance > 0), distance, np.inf)
