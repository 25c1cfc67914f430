"""What the animation is drawn on: obstacles, working areas, boxes that move, and how much of the scene is shown."""

from __future__ import annotations

from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.obstacles import footprints, outlines
from pbrg_mj.analysis.metrics.outcome import final_target
from pbrg_mj.log.read.run import Run
from pbrg_mj.world.scene.footprints import footprints_of
from pbrg_mj.world.scene.obstacles import box_centre

LEAST_SPAN = 1.0  # of the scene shown [m]
MARGIN = 0.12  # around what happened, as a share of its span
NEAR = 0.3  # how far from what happened a moving box is shown, as a share of its span


def still(run: Run) -> list[dict[str, Any]]:
    """Return what stands still: kind and corners [m] of working areas, walls, and boxes with all other solids.

    Thresholds and ramps are working areas here.
    """
    scenario = run.scenario
    walls = len(scenario.world.walls)
    patches = [{"kind": "patch", "corners": _rectangle(patch.start, patch.end)} for patch in scenario.world.patches]
    solid = [
        {"kind": "wall" if k < walls else "box", "corners": corners.tolist()}
        for k, corners in enumerate(outlines(footprints(scenario)))
    ]
    feet = outlines(footprints_of([part.as_wall() for part in scenario.world.terrain]))
    return [*patches, *({"kind": "patch", "corners": corners.tolist()} for corners in feet), *solid]


def moving(run: Run, time: np.ndarray) -> tuple[list[tuple[float, float]], np.ndarray]:
    """Return the sizes of the boxes that move, and their centres (F, boxes, 2) [m] at `time` (F,) [s].

    The log does not hold them: their motion follows from the scenario's waypoints.
    """
    boxes = run.scenario.world.moving_boxes if run.scenario.plant == "physics" else ()
    centres = [box_centre(box, time) for box in boxes]
    return [box.size for box in boxes], np.stack(centres, axis=1) if centres else np.zeros((len(time), 0, 2))


def lines(run: Run) -> list[list[float]]:
    """Return the true half-spaces [Gx, Gy, h] for hand points that define the target."""
    rows = final_target(run).rows
    return [[float(x), float(y), float(h)] for (x, y), h in zip(rows.G, rows.h, strict=True)]


def target(run: Run) -> list[float] | None:
    """Return the best admissible formation's point for the last r [m]; None where none is known."""
    point = final_target(run).point
    return None if point is None else [float(value) for value in point]


def extent(run: Run, states: dict[str, np.ndarray]) -> list[float]:
    """Return the part of the scene to show: least x, least y, largest x, largest y [m].

    Robots and the operator's reference decide; references that run away must not shrink the rest. Boxes that
    move are shown where they come near.
    """
    places = np.concatenate([states[name].reshape(-1, 2) for name in ("hand", "r")])
    places = np.concatenate([places, states["pose"][..., :2].reshape(-1, 2)])
    limit = run.scenario.outcome.diverged_beyond
    places = places[(np.abs(places) < limit).all(axis=1)]  # not NaN either
    low, high = (places.min(axis=0), places.max(axis=0)) if len(places) else (np.zeros(2), np.zeros(2))
    span = max(float((high - low).max()), LEAST_SPAN)
    edges = _edges(run, states["time"]).clip(low - NEAR * span, high + NEAR * span)
    low, high = np.minimum(low, edges.min(axis=0, initial=np.inf)), np.maximum(high, edges.max(axis=0, initial=-np.inf))
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, LEAST_SPAN / 2) + MARGIN * span
    return [*(middle - half).tolist(), *(middle + half).tolist()]


def _edges(run: Run, time: np.ndarray) -> np.ndarray:
    """Return opposite corners (k, 2) of all boxes that move, at all times [m]."""
    sizes, centres = moving(run, time)
    half = np.array(sizes).reshape(-1, 2) / 2
    return np.concatenate([centres - half, centres + half]).reshape(-1, 2)


def _rectangle(start: tuple[float, float], end: tuple[float, float]) -> list[list[float]]:
    (x0, y0), (x1, y1) = start, end
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
