"""The paper's two figures side by side: trajectories with the line, and governed references over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.atomic import by_suffix, write_whole
from pbrg_mj.analysis.outcome import final_target
from pbrg_mj.analysis.target import true_half_spaces
from pbrg_mj.errors import InputError
from pbrg_mj.log.run import Run
from pbrg_mj.scenario.surroundings import Wall

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette, told apart by colour-blind readers; line styles tell robots apart in grey.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
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


def _look(robot: int) -> dict[str, Any]:
    return {"color": COLOURS[robot % len(COLOURS)], "linestyle": LINES[robot % len(LINES)], "linewidth": 1.1}


def _trajectories(axes: Axes, run: Run) -> None:
    q = run.ticks.hand_true
    for robot in range(q.shape[1]):
        look = _look(robot)
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
    for wall in run.scenario.world.walls:
        axes.fill(*_wall_corners(wall).T, facecolor="0.8", edgecolor="0.4", linewidth=0.6)
    for G, h in zip(*true_half_spaces(run.scenario), strict=True):
        axes.axline(tuple(h * G), slope=_slope(G), color="black", linewidth=0.9, linestyle=(0, (8, 2)))
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(loc="best")


def _formation(axes: Axes, q: np.ndarray) -> None:
    """Join the robots where they ended: the formation as a closed line in their order around its centre."""
    centre = q.mean(axis=0)
    around = np.argsort(np.arctan2(*(q - centre).T[::-1]), kind="stable")
    closed = q[np.append(around, around[0])]
    axes.plot(closed[:, 0], closed[:, 1], color="0.5", linewidth=0.7)


def _points(axes: Axes, run: Run) -> None:
    axes.plot(*run.ticks.reference[-1], "*", label="r", **POINT, markersize=9, markerfacecolor="white")
    best = final_target(run)
    if best is not None:
        axes.plot(*best, "x", label="best admissible", **POINT, markersize=5)


def _references(axes: Axes, run: Run, component: int) -> None:
    for robot in range(run.ticks.m.shape[1]):
        axes.plot(run.ticks.time, run.ticks.m[:, robot, component], label=f"$m_{{{robot + 1}}}$", **_look(robot))
    if len(run.optima.time):
        star = run.optima.m[:, component]
        axes.plot(run.optima.time, star, color="black", linestyle="--", linewidth=1.4, label="$m^*$")
    axes.set_ylabel(f"$m_{'xy'[component]}$ [m]")


def _wall_corners(wall: Wall) -> np.ndarray:
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]]) * wall.thickness / 2
    return np.array([start - across, end - across, end + across, start + across])


def _slope(G: np.ndarray) -> float:
    return float("inf") if G[1] == 0 else float(-G[0] / G[1])
