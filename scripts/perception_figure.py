"""Write docs/img/perception.png: one scan of one robot through all stages of the estimator of points.

python scripts/perception_figure.py
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from pbrg_mj.analysis.metrics.obstacles import footprints, outlines
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.estimator import PointEstimator, PointMemory
from pbrg_mj.perception.points.known_free import edge_of_free
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.occupancy_grid import OccupancyGrid
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.sensing.readings import Readings

FILE = Path(__file__).resolve().parents[1] / "docs" / "img" / "perception.png"
WORLD = ("families/clutter", ["seed=3", "set_up=recommended", "estimator.unknown=closed", "reference.solver=none"])
MOMENT, ROBOT = 2.0, 0  # [s]
HALF = 2.2  # of the view [m]
BODY, SOLID, ECHO, EDGE, FACE = "#2973c7", "#d9c3ba", "#b03a2e", "#7f8c8d", "#1e8449"


class Seen(NamedTuple):
    """One moment of a run."""

    readings: Readings
    memory: PointMemory
    m: np.ndarray  # (2,) of the robot [m]
    estimator: PointEstimator
    solids: list[np.ndarray]


def moment() -> Seen:
    """Run the world to the first scan after `MOMENT`."""
    simulation = Simulation.build(load_scenario(*WORLD).scenario)
    estimator, m = simulation.loop.estimator, None
    assert isinstance(estimator, PointEstimator)
    memory = estimator.init()
    solids = list(outlines(footprints(simulation.loop.scenario)))
    for tick in simulation.control_ticks():
        _, memory = estimator.step_towards(tick.readings, tick.time, memory, m)
        m = tick.solution.m
        if tick.time >= MOMENT and tick.readings.new_scan:
            return Seen(tick.readings, memory, m[ROBOT], estimator, solids)
    raise ValueError(f"the run ends before {MOMENT} s")


def scan(axes: Axes, seen: Seen) -> None:
    x, y, heading = seen.readings.body_pose[ROBOT]
    directions = seen.estimator.parameters.directions
    turned = directions @ np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    for (dx, dy), reach in zip(turned, seen.readings.ranges[ROBOT], strict=True):
        silent = np.isnan(reach)
        length = seen.estimator.parameters.range_max if silent else reach
        axes.plot([x, x + length * dx], [y, y + length * dy], color="#cccccc" if silent else "#9db8d9", linewidth=0.5)
        if not silent:
            axes.plot(x + reach * dx, y + reach * dy, ".", color=ECHO, markersize=3)


def remembered(axes: Axes, seen: Seen) -> None:
    points = seen.memory.points[ROBOT]
    on = points["live"] & points["binds"]
    age = seen.memory.scans - points["scan"][on]
    axes.scatter(points["x"][on], points["y"][on], c=age, cmap="autumn", s=4, vmin=0, vmax=10, zorder=3)


def known_free(axes: Axes, seen: Seen) -> None:
    x, y, heading = seen.readings.body_pose[ROBOT]
    pose = ScanPose(x, y, heading, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    parameters, ranges = seen.estimator.parameters, seen.readings.ranges[ROBOT]
    points = np.concatenate([seen.memory.points[ROBOT], no_points(1, len(ranges))[0]])
    beams, places = SeenBeams(ranges, parameters.directions), seen.readings.body_pose[None, :, :2].copy()
    before = seen.memory.past[ROBOT], seen.memory.past_poses[ROBOT]
    echoes = add_scan(points, seen.memory.scans, beams, pose, (places, ROBOT), before, parameters)
    grid = OccupancyGrid(seen.memory.free[ROBOT].copy(), seen.memory.least[ROBOT].copy())
    edge = edge_of_free(echoes, beams, pose, grid, parameters)
    axes.plot(edge.x, edge.y, ".", color=EDGE, markersize=3)
    axes.plot(echoes.x[echoes.binds], echoes.y[echoes.binds], ".", color=ECHO, markersize=3)


def half_spaces(axes: Axes, seen: Seen) -> None:
    known = seen.memory.half_spaces
    G, h = known.G[ROBOT][known.active[ROBOT]], known.h[ROBOT][known.active[ROBOT]]
    side = np.linspace(-2 * HALF, 2 * HALF, 600)
    x, y = np.meshgrid(side + seen.readings.body_pose[ROBOT, 0], side + seen.readings.body_pose[ROBOT, 1])
    inside = np.min(h - np.stack([x, y], axis=-1) @ G.T, axis=-1)
    axes.contourf(x, y, inside, levels=[0.0, 1e9], colors=[FACE], alpha=0.2)
    axes.contour(x, y, inside, levels=[0.0], colors=[FACE], linewidths=1.0)
    hand, target = seen.readings.body_pose[ROBOT], seen.m + seen.estimator.formation[ROBOT]
    axes.annotate("", target, hand[:2], arrowprops={"arrowstyle": "->", "color": BODY})


def main() -> None:
    """Draw all stages."""
    seen = moment()
    stages = {
        "1  a scan: echoes and silent beams": (scan,),
        "2  remembered: six scans and what is hidden": (remembered,),
        "3  the edge of what is known to be free": (known_free,),
        "4  half-spaces around the way": (remembered, half_spaces),
    }
    figure = Figure(figsize=(11.0, 3.2), layout="constrained")
    for axes, (title, draw) in zip(figure.subplots(1, len(stages)), stages.items(), strict=True):
        for corners in seen.solids:
            axes.add_patch(Polygon(corners, facecolor=SOLID))
        for k, (x, y, _) in enumerate(seen.readings.body_pose):
            fill = BODY if k == ROBOT else "none"
            axes.add_patch(Circle((x, y), seen.estimator.parameters.body_radius, facecolor=fill, edgecolor=BODY))
        for one in draw:
            one(axes, seen)
        x, y, _ = seen.readings.body_pose[ROBOT]
        axes.set(xlim=(x - HALF, x + HALF), ylim=(y - HALF, y + HALF), aspect="equal", xticks=[], yticks=[])
        axes.set_title(title, fontsize=8, loc="left")
    figure.savefig(FILE, dpi=110)


if __name__ == "__main__":
    main()
