"""What a picture of a run shows of the plane: the team's way, what held it, and what is near (docs/plot.md)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pbrg_mj.analysis.metrics.best_formation import given_rows
from pbrg_mj.analysis.metrics.multiplier_rows import binding_area
from pbrg_mj.analysis.metrics.obstacles import footprints, outlines
from pbrg_mj.analysis.metrics.per_tick import per_tick
from pbrg_mj.log.read.run import Run
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.world.scene.obstacles import box_centre

BESIDE = 1.0  # how far off the team's way things are near, at least [m]
SHARE = 0.5  # of the longer side of the team's way, if that is more
FARTHEST = 30.0  # from the team's start, what is farther is not shown [m]: a run may diverge


def area_of_interest(run: Run, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner (2,) [m] of what a picture should show beside `points` (k, 2) [m].

    That is the team's way, the rectangle around hand points and `points`; where a half-space held a robot; and what
    stands, is given, or moves near: see `near`. Near things are shown whole, long ones to BESIDE past the way.
    """
    start = np.mean(run.scenario.team.start, axis=0)
    shown = [start[None], *(_not_far(some, start) for some in (run.ticks.hand_true.reshape(-1, 2), points))]
    low, high = _around(shown)
    beside = near(low, high)
    held = per_tick(run, binding_area).reshape(-1, 2)
    shown += [_not_far(held, start), *_lines(run, np.vstack(shown), beside)]
    low, high = _around(shown)
    shown += [_part(corners, low, high, beside) for corners in outlines(footprints(run.scenario))]
    shown += [moving_box_area(run, box, beside) for box in run.scenario.world.moving_boxes]
    return _around(shown)


def near(low: np.ndarray, high: np.ndarray) -> float:
    """Return how far [m] from the team's way, a rectangle, things count as near."""
    return max(BESIDE, SHARE * float(np.max(high - low)))


def moving_box_area(run: Run, box: MovingBox, beside: float) -> np.ndarray:
    """Return the corners (k, 2) [m] around a moving box at all times when it is within `beside` of a robot."""
    way, half = box_centre(box, run.ticks.time), np.array(box.size) / 2
    beyond = np.maximum(np.abs(run.ticks.hand_true - way[:, None]) - half, 0.0)
    there = way[(np.linalg.norm(beyond, axis=-1) <= beside).any(axis=1)]
    return np.vstack([there - half, there + half])


def _around(shown: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    points = np.vstack(shown)
    return points.min(axis=0), points.max(axis=0)


def _not_far(points: np.ndarray, start: np.ndarray) -> np.ndarray:
    return points[np.all(np.abs(points - start) < FARTHEST, axis=1)]


def _lines(run: Run, way: np.ndarray, beside: float) -> Iterator[np.ndarray]:
    """Yield the point (1, 2) nearest to the way (k, 2) on every given line that passes within `beside` of it."""
    rows = given_rows(run.scenario)
    for G, h in zip(rows.G, rows.h, strict=True):
        ahead = h - way @ G
        nearest = int(np.abs(ahead).argmin())
        if abs(ahead[nearest]) <= beside:
            yield way[nearest, None] + ahead[nearest] * G


def _part(corners: np.ndarray, low: np.ndarray, high: np.ndarray, beside: float) -> np.ndarray:
    """Return the corners (2, 2) of what is shown of a thing with these corners (c, 2); (0, 2) if it is not near."""
    first, last = corners.min(axis=0), corners.max(axis=0)
    gap = float(np.max([first - high, low - last]))
    if gap > beside:
        return np.zeros((0, 2))
    end = max(BESIDE, gap)  # of a wall along the way, which must not make the team small
    return np.where(last - first > 2 * end, np.clip([first, last], low - end, high + end), [first, last])
