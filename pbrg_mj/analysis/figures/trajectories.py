"""The plan: trajectories with walls, lines and the formation, as in the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.figures.style import MARKERS, finite, legend_above, robot_style
from pbrg_mj.analysis.metrics.obstacles import footprints
from pbrg_mj.analysis.metrics.outcome import final_target
from pbrg_mj.log.read.run import Run
from pbrg_mj.world.scene.footprints import Rectangles, wall_rectangles

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINT: dict[str, Any] = {"color": "black", "linestyle": "none"}


def trajectories(axes: Axes, run: Run) -> None:
    """Draw where the hand points went: from the hollow mark to the full one."""
    from matplotlib.patheffects import withStroke

    halo = {"path_effects": [withStroke(linewidth=2, foreground="white")], "fontsize": 7}
    q = finite(run.ticks.hand_true)
    for robot in range(q.shape[1]):
        style, marker = robot_style(robot, q.shape[1]), MARKERS[robot % len(MARKERS)]
        axes.plot(q[:, robot, 0], q[:, robot, 1], **style)
        axes.plot(*q[0, robot], marker, color=style["color"], markerfacecolor="white", markersize=4)
        axes.plot(*q[-1, robot], marker, color=style["color"], markersize=4)
        axes.annotate(str(robot + 1), q[-1, robot], xytext=(-9, -9), textcoords="offset points", **halo)
    _formation(axes, q[-1])
    _points(axes, run)
    # Walls and lines run through the whole picture; they must not stretch it.
    axes.set_xlim(axes.get_xlim())
    axes.set_ylim(axes.get_ylim())
    axes.set_aspect("equal")
    _floor(axes, run)
    for corners in _corners(footprints(run.scenario)):
        axes.fill(*corners.T, facecolor="0.8", edgecolor="0.4", linewidth=0.6)
    lines = final_target(run).rows
    for G, h in zip(lines.G, lines.h, strict=True):
        axes.axline(tuple(h * G), slope=_slope(G), color="black", linewidth=0.9, linestyle=(0, (8, 2)))
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    legend_above(axes)


def _floor(axes: Axes, run: Run) -> None:
    """Draw working areas under everything else, and dashed where moving boxes stop."""
    world = run.scenario.world
    for patch in world.patches:
        (x0, y0), (x1, y1) = patch.start, patch.end
        axes.fill([x0, x1, x1, x0], [y0, y0, y1, y1], facecolor="#F2E6D0", edgecolor="none", zorder=0)
    stops = [box.at(stop).as_wall() for box in world.moving_boxes for stop in box.waypoints]
    for corners in _corners(wall_rectangles(stops)):
        axes.fill(*corners.T, fill=False, edgecolor="0.4", linewidth=0.6, linestyle="--")


def _formation(axes: Axes, q: np.ndarray) -> None:
    """Join the robots where they ended: the formation as a closed line in their order around its centre."""
    centre = q.mean(axis=0)
    around = np.argsort(np.arctan2(*(q - centre).T[::-1]), kind="stable")
    closed = q[np.append(around, around[0])]
    axes.plot(closed[:, 0], closed[:, 1], color="0.5", linewidth=0.7)


def _points(axes: Axes, run: Run) -> None:
    axes.plot(*run.ticks.reference[-1], "*", label="r", **POINT, markersize=9, markerfacecolor="white")
    best = final_target(run).point
    if best is not None:
        axes.plot(*best, "x", label="best admissible", **POINT, markersize=5)


def _corners(rectangles: Rectangles) -> np.ndarray:
    """Return the corners (w, 4, 2) of the footprints, in turn."""
    along = rectangles.axis * rectangles.half_size[:, :1]
    across = np.column_stack([-rectangles.axis[:, 1], rectangles.axis[:, 0]]) * rectangles.half_size[:, 1:]
    c = rectangles.centre
    return np.stack([c - along - across, c + along - across, c + along + across, c - along + across], axis=1)


def _slope(G: np.ndarray) -> float:
    return float("inf") if G[1] == 0 else float(-G[0] / G[1])
