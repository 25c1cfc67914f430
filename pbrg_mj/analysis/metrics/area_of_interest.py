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
APPROACH = 3.0  # how far from robots a moving box that comes near is followed, at least [m]
FARTHEST = 30.0  # from the team's start, what is farther is not shown [m]: a run may diverge
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
DIRECTIONS = np.array([np.cos(np.arange(64) * np.pi / 32), np.sin(np.arange(64) * np.pi / 32)])  # (2, 64)


def area_of_interest(run: Run, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner (2,) [m] around the points of interest, see there."""
    return _around([points_of_interest(run, points)])


def points_of_interest(run: Run, points: np.ndarray) -> np.ndarray:
    """Return the points (s, 2) [m] that a picture should show so that it shows what matters.

    They enclose the team's way, which is the rectangle around hand points and `points` (k, 2) [m]; where half-spaces
    held robots; and what stands, is given, or moves near: see `near`. Things are whole, long ones end BESIDE past it.
    """
    start = np.mean(run.scenario.team.start, axis=0)
    way = np.vstack([start, *(_not_far(some, start) for some in (run.ticks.hand_true.reshape(-1, 2), points))])
    beside = near(*_around([way]))
    held = per_tick(run, binding_area).reshape(-1, 2)
    shown = [_outermost(way), _outermost(_not_far(held, start)), *_lines(run, way, beside)]
    low, high = _around(shown)
    shown += [_part(corners, low, high, beside) for corners in outlines(footprints(run.scenario))]
    shown += [_outermost(moving_box_area(run, box, beside)) for box in run.scenario.world.moving_boxes]
    return np.vstack(shown)


def near(low: np.ndarray, high: np.ndarray) -> float:
    """Return how far [m] from the team's way, a rectangle, things count as near."""
    return max(BESIDE, SHARE * float(np.max(high - low)))


def moving_box_area(run: Run, box: MovingBox, beside: float) -> np.ndarray:
    """Return the corners (k, 2) [m] of a moving box while within APPROACH of a robot; none if it is never near."""
    way, half = box_centre(box, run.ticks.time), np.array(box.size) / 2
    beyond = np.maximum(np.abs(run.ticks.hand_true - way[:, None]) - half, 0.0)
    distance = np.nan_to_num(np.linalg.norm(beyond, axis=-1), nan=np.inf).min(axis=1)
    there = way[distance <= max(APPROACH, beside)] if distance.min() <= beside else way[:0]
    return np.vstack([there + half * corner for corner in CORNERS])


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


def _outermost(points: np.ndarray) -> np.ndarray:
    """Return the points (s, 2) that are farthest out in DIRECTIONS: as good as all (k, 2), and few."""
    return points[np.unique((points @ DIRECTIONS).argmax(axis=0))] if len(points) else points


def _part(corners: np.ndarray, low: np.ndarray, high: np.ndarray, beside: float) -> np.ndarray:
    """Return the corners (k, 2) of what is shown of a thing with these corners (c, 2); (0, 2) if it is not near."""
    first, last = corners.min(axis=0), corners.max(axis=0)
    gap = float(np.max([first - high, low - last]))
    if gap > beside:
        return np.zeros((0, 2))
    end = max(BESIDE, gap)  # of a wall along the way, which must not make the team small
    for axis in np.flatnonzero(last - first > 2 * end).tolist():
        corners = _cut(_cut(corners, axis, 1.0, high[axis] + end), axis, -1.0, end - low[axis])
    return corners


def _cut(corners: np.ndarray, axis: int, sign: float, most: float) -> np.ndarray:
    """Return the part of a convex polygon (c, 2) where sign * q[axis] <= most."""
    kept = []
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        over, next_over = sign * here[axis] - most, sign * there[axis] - most
        if over <= 0:
            kept.append(here)
        if over * next_over < 0:
            kept.append(here + over / (over - next_over) * (there - here))
    return np.array(kept).reshape(-1, 2)
