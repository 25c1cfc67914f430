"""Styles of robots and curves: colour, line style and marker, so that they differ in grey too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette, distinct for colour-blind readers; in grey, line styles and markers are distinct.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
MARKS = 8  # on a curve
MOST_NAMES = 8  # robots that a legend names one by one
NAMES_PER_LINE = 7
THIN, THICK = 1.1, 1.4  # [points]
OPTIMUM: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": THICK}


def robot_style(robot: int, robots: int) -> dict[str, Any]:
    """Return colour and line style of a robot: the palette for a few, a run of colours in their order for many."""
    line = {"linestyle": LINES[robot % len(LINES)], "linewidth": THIN}
    if robots <= len(COLOURS):
        return line | {"color": COLOURS[robot]}
    from matplotlib import colormaps

    return line | {"color": colormaps["viridis"](0.95 * robot / (robots - 1))}  # its last yellows are lost on white


def marked_style(robot: int, robots: int, samples: int) -> dict[str, Any]:
    """Return a robot's robot_style with its marker at a few of the samples, at others than its neighbours' are."""
    apart = max(1, samples // MARKS)
    place = (robot * apart // robots, apart)
    return robot_style(robot, robots) | {"marker": MARKERS[robot % len(MARKERS)], "markersize": 3, "markevery": place}


def label(symbol: str, robot: int, robots: int) -> str | None:
    """Return the legend's name of a robot's curve; for a large team only its first and last: colours run between."""
    named = robots <= MOST_NAMES or robot in (0, robots - 1)
    return f"${symbol}_{{{robot + 1}}}$" if named else None


def finite(values: np.ndarray) -> np.ndarray:
    """Return values with a gap where they are not finite."""
    return np.where(np.isfinite(values), values, np.nan)


def legend_above(axes: Axes) -> None:
    """Put the legend above the panel, where it hides nothing."""
    handles, names = axes.get_legend_handles_labels()
    if handles:
        place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.1, "frameon": False}
        columns = {"ncols": min(NAMES_PER_LINE, len(handles)), "columnspacing": 0.8, "handletextpad": 0.3}
        axes.legend(handles, names, handlelength=1.9, **place, **columns)
