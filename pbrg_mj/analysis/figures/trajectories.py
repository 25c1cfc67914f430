"""The plan: trajectories with walls, lines and the formation, as in the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.figures.style import MARKERS, finite, legend_above, robot_style
from pbrg_mj.analysis.metrics.area_of_interest import area_of_interest
from pbrg_mj.analysis.metrics.obstacles import closest_approach, footprints, moving_footprints, outlines
from pbrg_mj.analysis.metrics.outcome import final_target
from pbrg_mj.log.read.run import Run
from pbrg_mj.scenario.schema import BoxWaypoint
from pbrg_mj.world.scene.footprints import footprints_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BORDER = 0.05  # around it all, as a share of its size
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
    _frame(axes, run)
    _floor(axes, run)
    _moving(axes, run, q)
    for corners in outlines(footprints(run.scenario)):
        axes.fill(*corners.T, facecolor="0.8", edgecolor="0.4", linewidth=0.6)
    _lines(axes, run)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    legend_above(axes)


def _frame(axes: Axes, run: Run) -> None:
    """Show the team's way, r, what held robots, and what stands or moves near; lines run through the whole picture."""
    low, high = area_of_interest(run, np.concatenate([run.ticks.reference[-1:], _best(run)]))
    border = BORDER * max(float((high - low).max()), 1.0)
    axes.set_xlim(low[0] - border, high[0] + border)
    axes.set_ylim(low[1] - border, high[1] + border)
    axes.set_aspect("equal")


def _lines(axes: Axes, run: Run) -> None:
    """Draw the lines for hand points that pass through the picture; the legend names them once."""
    x, y = np.meshgrid(axes.get_xlim(), axes.get_ylim())
    rows, name = final_target(run).rows, "line for hand points"
    for G, h in zip(rows.G, rows.h, strict=True):
        beyond = G[0] * x + G[1] * y - h
        if beyond.min() < 0 < beyond.max():
            style: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (8, 2))}
            axes.axline(tuple(h * G), slope=_slope(G), label=name, **style)
            name = None


def _floor(axes: Axes, run: Run) -> None:
    """Draw working areas under everything else."""
    for patch in run.scenario.world.patches:
        (x0, y0), (x1, y1) = patch.start, patch.end
        axes.fill([x0, x1, x1, x0], [y0, y0, y1, y1], facecolor="#F2E6D0", edgecolor="none", zorder=0)


def _moving(axes: Axes, run: Run, q: np.ndarray) -> None:
    """Draw boxes that move: filled where they came nearest to a robot, dashed where they stop, their ways dotted."""
    boxes, name = run.scenario.world.moving_boxes, "moving box where nearest"
    for box in boxes:
        near = closest_approach(box, run.ticks.time, q)
        there = box.at(BoxWaypoint(time=0.0, center=(float(near[0]), float(near[1]))))
        (corners,) = outlines(footprints_of([there.as_wall()]))
        label = name if _is_shown(axes, corners) else None
        axes.fill(*corners.T, facecolor="0.9", edgecolor="0.4", linewidth=0.6, linestyle=":", label=label)
        name = None if label else name
    for corners in outlines(moving_footprints(run.scenario)):
        axes.fill(*corners.T, fill=False, edgecolor="0.4", linewidth=0.6, linestyle="--")
    for box in boxes:
        way = np.array([waypoint.center for waypoint in box.waypoints])
        axes.plot(*way.T, color="0.4", linewidth=0.6, linestyle=":")


def _is_shown(axes: Axes, corners: np.ndarray) -> bool:
    """Return whether any of a rectangle with these corners (4, 2) [m] is in the picture."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    return bool(x0 < right and x1 > left and y0 < top and y1 > bottom)


def _formation(axes: Axes, q: np.ndarray) -> None:
    """Join the robots where they ended: the formation as a closed line in their order around its centre."""
    centre = q.mean(axis=0)
    around = np.argsort(np.arctan2(*(q - centre).T[::-1]), kind="stable")
    closed = q[np.append(around, around[0])]
    axes.plot(closed[:, 0], closed[:, 1], color="0.5", linewidth=0.7)


def _points(axes: Axes, run: Run) -> None:
    axes.plot(*run.ticks.reference[-1], "*", label="r", **POINT, markersize=9, markerfacecolor="white")
    for best in _best(run):
        axes.plot(*best, "x", label="best admissible", **POINT, markersize=5)


def _best(run: Run) -> np.ndarray:
    """Return the best admissible reference, (1, 2) [m]; (0, 2) where there is none."""
    best = final_target(run).point
    return np.zeros((0, 2)) if best is None else best[None]


def _slope(G: np.ndarray) -> float:
    return float("inf") if G[1] == 0 else float(-G[0] / G[1])
