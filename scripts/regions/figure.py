"""Draw docs/img/safe_regions.png: the regions of several methods in some views."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from regions.methods import ABOUT, ALONG, OURS, TRUE_ABOUT, regions
from regions.polygon import cut, inside_disc
from regions.views import View

from pbrg_mj.analysis.metrics.obstacles import outlines

FILE = Path(__file__).resolve().parents[2] / "docs" / "img" / "safe_regions.png"
HALF = 2.6  # of the view [m]
SOLID, ECHO, WAY = "#d9c3ba", "#b03a2e", "#222222"
STYLES = {  # colour, line, width
    OURS: ("#1e8449", "-", 1.6),
    ABOUT: ("#2973c7", "-", 1.2),
    ALONG: ("#cc8529", "-", 1.2),
    TRUE_ABOUT: ("#7f8c8d", "--", 1.0),
}


def draw(views: list[View]) -> None:
    """Write the figure, a panel a view."""
    figure = Figure(figsize=(2.4 * len(views), 3.0), layout="constrained")
    for axes, one in zip(np.atleast_1d(figure.subplots(1, len(views))), views, strict=True):
        for corners in outlines(one.solids):
            axes.add_patch(Polygon(corners, facecolor=SOLID))
        found = regions(one)
        for name, (colour, line, width) in STYLES.items():
            region = found.get(name, (None, 0.0))[0]
            if region is not None:
                corners = cut(inside_disc(one.hand, one.reach), *region)
                axes.add_patch(Polygon(corners, fill=False, edgecolor=colour, linestyle=line, linewidth=width))
                if name == OURS:
                    axes.add_patch(Polygon(corners, facecolor=colour, alpha=0.15))
        axes.plot(*one.places.at.T, ".", color=ECHO, markersize=2)
        axes.annotate("", one.target, one.hand, arrowprops={"arrowstyle": "->", "color": WAY})
        x, y = 0.7 * one.hand + 0.3 * one.target
        axes.set(xlim=(x - HALF, x + HALF), ylim=(y - HALF, y + HALF), aspect="equal", xticks=[], yticks=[])
        axes.set_title(one.name, fontsize=8, loc="left")
    lines = [Line2D([], [], color=c, linestyle=s, linewidth=w) for c, s, w in STYLES.values()]
    figure.legend(lines, list(STYLES), loc="outside lower center", ncols=len(lines), fontsize=8, frameon=False)
    figure.savefig(FILE, dpi=110)
