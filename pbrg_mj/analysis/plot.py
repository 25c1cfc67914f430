"""The paper's two figures side by side: trajectories with the line, and governed references over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.atomic import by_suffix, write_whole
from pbrg_mj.analysis.obstacles import footprints
from pbrg_mj.analysis.outcome import final_target
from pbrg_mj.errors import InputError
from pbrg_mj.log.run import Run
from pbrg_mj.world.geometry import Rectangles, wall_rectangles

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette, told apart by colour-blind readers; line styles tell robots apart in grey.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
MOST_NAMES = 8  # robots that a legend names one by one
SIZE = (7.2, 3.4)  # [inch], two columns of a journal page
# Without these the file would carry the date and random names.
STYLE: Any = {"svg.hashsalt": "pbrg-mj", "font.size": 8, "legend.fontsize": 7, "axes.titlesize": 8, "pdf.fonttype": 42}
POINT: dict[str, Any] = {"color": "black", "linestyle": "none"}
METADATA: dict[str, dict[str, Any]] = {
    ".pdf": {"CreationDate": None},
    ".png": {},
    ".svg": {"Date": None},
}


def plot(run: Run, path: Path) -> None:
    """Draw a run into `path`; .pdf, .png or .svg.

    Raises InputError for another suffix, an empty log, or when matplotlib is not installed.
    """
    metadata = by_suffix(path, METADATA)
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("plots need matplotlib: pip install 'pbrg-mj[plot]'") from error
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, layout="constrained")
        left, upper, lower = figure.subplot_mosaic([["q", "x"], ["q", "y"]]).values()
        _trajectories(left, run)
        _references(upper, run, 0)
        _references(lower, run, 1)
        upper.tick_params(labelbottom=False)
        upper.legend(loc="best", ncols=3)
        lower.set_xlabel("time [s]")
        kind = path.suffix.lower()[1:]
        write_whole(path, lambda whole: figure.savefig(whole, format=kind, dpi=200, metadata=metadata))


def _look(robot: int, robots: int) -> dict[str, Any]:
    """Return colour and line style of a robot: the palette for a few, a run of colours in their order for many."""
    line = {"linestyle": LINES[robot % len(LINES)], "linewidth": 1.1}
    if robots <= len(COLOURS):
        return line | {"color": COLOURS[robot]}
    from matplotlib import colormaps

    return line | {"color": colormaps["viridis"](0.95 * robot / (robots - 1))}  # its last yellows are lost on white


def _label(robot: int, robots: int) -> str | None:
    """Return the legend's name of a reference; for a large team only its first and last, between which colours run."""
    named = robots <= MOST_NAMES or robot in (0, robots - 1)
    return f"$m_{{{robot + 1}}}$" if named else None


def _trajectories(axes: Axes, run: Run) -> None:
    q = run.ticks.hand_true
    for robot in range(q.shape[1]):
        look = _look(robot, q.shape[1])
        axes.plot(q[:, robot, 0], q[:, robot, 1], **look)
        axes.plot(*q[0, robot], "o", color=look["color"], markerfacecolor="white", markersize=4)
        axes.plot(*q[-1, robot], "o", color=look["color"], markersize=4)
        axes.annotate(str(robot + 1), q[-1, robot], xytext=(-9, -9), textcoords="offset points", fontsize=7)
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
    axes.legend(loc="best")


def _floor(axes: Axes, run: Run) -> None:
    """Draw working areas under everything else, and dashed where moving boxes stop."""
    world = run.scenario.world
    for patch in world.patches:
        (x0, y0), (x1, y1) = patch.start, patch.end
        axes.fill([x0, x1, x1, x0], [y0, y0, y1, y1], facecolor="#F2E6D0", edgecolor="none", zorder=0)
    stops = [box.at(stop).as_wall() for box in world.moving_boxes for stop in box.stops]
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


def _references(axes: Axes, run: Run, component: int) -> None:
    n = run.ticks.m.shape[1]
    for robot in range(n):
        values = run.ticks.m[:, robot, component]
        axes.plot(run.ticks.time, values, label=_label(robot, n), **_look(robot, n))
    if len(run.optima.time):
        star = run.optima.m[:, component]
        axes.plot(run.optima.time, star, color="black", linestyle="--", linewidth=1.4, label="$m^*$")
    axes.set_ylabel(f"$m_{'xy'[component]}$ [m]")


def _corners(rectangles: Rectangles) -> np.ndarray:
    """Return the corners (w, 4, 2) of the footprints, in turn."""
    along = rectangles.axis * rectangles.half_size[:, :1]
    across = np.column_stack([-rectangles.axis[:, 1], rectangles.axis[:, 0]]) * rectangles.half_size[:, 1:]
    c = rectangles.centre
    return np.stack([c - along - across, c + along - across, c + along + across, c - along + across], axis=1)


def _slope(G: np.ndarray) -> float:
    return float("inf") if G[1] == 0 else float(-G[0] / G[1])
