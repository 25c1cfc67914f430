"""A run as a drawing: obstacles, the robots' ways, starts, ends and the reference."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pbrg_mj.analysis.metrics.obstacles import footprints, moving_footprints, outlines
from pbrg_mj.api.run import Run

SIZE = 260  # pixels of its longer side
MOST_POINTS = 150  # of a robot's way
ROOM = 0.4  # [m] around all robots
LEGEND = (
    "Pictures: hand points' ways from the start (ring) to the end (dot), walls and obstacles (brown), moving boxes at"
    " their waypoints (orange), and the formation about the last reference (grey rings); the bar is 1 m long."
)
COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#b9770e", "#117a65", "#7b241c", "#34495e")


def picture(run: Run) -> str:
    """Return a run as SVG: nothing in it is text from the log."""
    settings, way = run.scenario.settings, run.arrays["q_true_m"]
    goal = run.arrays["r_m"][-1] + np.array(settings.team.formation)
    seen = np.concatenate([way.reshape(-1, 2), goal])
    seen = seen[np.isfinite(seen).all(axis=1)]
    low, high = seen.min(axis=0) - ROOM, seen.max(axis=0) + ROOM
    scale = SIZE / float((high - low).max())

    def place(points: np.ndarray) -> np.ndarray:
        return np.column_stack([points[:, 0] - low[0], high[1] - points[:, 1]]) * scale

    width, height = (high - low) * scale
    sizes = f'viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}"'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" {sizes}>']
    parts += [_shape("polygon", place(corners), "#b08968") for corners in outlines(footprints(settings))]
    parts += [_shape("polygon", place(corners), "#f5b971") for corners in outlines(moving_footprints(settings))]
    parts += [_circle(one, "none", "#888", 4) for one in place(goal)]
    bar = np.array([[low[0] + 0.1, low[1] + 0.1], [low[0] + 1.1, low[1] + 0.1]])
    parts.append(_shape("polyline", place(bar), "none", "#000"))
    every = max(1, len(way) // MOST_POINTS)
    for robot in range(way.shape[1]):
        colour, line = COLOURS[robot % len(COLOURS)], place(np.concatenate([way[::every, robot], way[-1:, robot]]))
        parts += [
            _shape("polyline", line, "none", colour),
            _circle(line[0], "#fff", colour, 2),
            _circle(line[-1], colour, colour, 3),
        ]
    return "".join([*parts, "</svg>"])


def _shape(kind: str, points: np.ndarray, fill: str, stroke: str = "none") -> str:
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in _finite(points))
    return f'<{kind} points="{text}" fill="{fill}" stroke="{stroke}" stroke-width="1.2"/>'


def _circle(centre: Sequence[float] | np.ndarray, fill: str, stroke: str, radius: float) -> str:
    x, y = centre
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}" stroke="{stroke}"/>'


def _finite(points: np.ndarray) -> Iterable[np.ndarray]:
    return points[np.isfinite(points).all(axis=1)]
