"""Write docs/img/worlds.png: three worlds of every bundled family.

python scripts/worlds_figure.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from pbrg_mj.analysis.metrics.obstacles import footprints, moving_footprints, outlines
from pbrg_mj.scenario.bundled import bundled_families
from pbrg_mj.scenario.checks.world import body_centres
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import footprints_of

FILE = Path(__file__).resolve().parents[1] / "docs" / "img" / "worlds.png"
SEEDS = (1, 2, 3)
PER_ROW = 2  # families
HALF = 4.6  # of the view [m]


def draw(axes: Axes, scenario: Scenario) -> None:
    """Draw obstacles, robots at the start, and the formation around the reference."""
    r, radius = np.array(scenario.operator.reference), robot_size(scenario.robot).body_radius
    terrain = footprints_of([part.as_wall() for part in scenario.world.terrain])
    panes = footprints_of([wall for wall in scenario.world.obstacles if wall.glass])
    for around, color in ((terrain, "#d9d2c0"), (footprints(scenario), "#9e5c47"), (panes, "#9cd3e6")):
        for corners in outlines(around):
            axes.add_patch(Polygon(corners, facecolor=color, edgecolor=color))
    moving = moving_footprints(scenario)
    for corners in outlines(moving):
        axes.add_patch(Polygon(corners, facecolor="none", edgecolor="#cc8529"))
    for box in scenario.world.moving_boxes:
        axes.plot(*zip(*(stop.center for stop in box.waypoints), strict=True), color="#cc8529", linewidth=0.8)
    for centre in body_centres(scenario):
        axes.add_patch(Circle(centre, radius, facecolor="#2973c7"))
    for place in r + np.array(scenario.team.formation):
        axes.add_patch(Circle(tuple(place), radius, facecolor="none", edgecolor="#2973c7", linewidth=0.6))
    axes.plot(*r, "*", color="#d62728", markersize=5)
    axes.set(xlim=(-HALF, HALF), ylim=(-HALF, HALF), aspect="equal", xticks=[], yticks=[])


def main() -> None:
    families = list(bundled_families())
    rows = -(-len(families) // PER_ROW)
    figure = Figure(figsize=(10.5, 1.9 * rows), layout="constrained")
    grid = figure.subplots(rows, PER_ROW * len(SEEDS), squeeze=False)
    for panel in grid.flat:
        panel.set_axis_off()
    for k, name in enumerate(families):
        for s, seed in enumerate(SEEDS):
            panel = grid[k // PER_ROW][k % PER_ROW * len(SEEDS) + s]
            panel.set_axis_on()
            draw(panel, load_scenario(name, [f"seed={seed}"]).scenario)
            panel.set_title(f"{name.removeprefix('families/')} {seed}", fontsize=8)
    figure.savefig(FILE, dpi=110)


if __name__ == "__main__":
    main()
