"""Panels put on one page, and the page into a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.figures.time_histories import consensus, gap, margin, multipliers, references
from pbrg_mj.analysis.figures.trajectories import trajectories
from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Draw = Callable[["Axes", Run], None]
# By panel, what stands in it from the top down, and how many rows of the page each takes.
PANELS: dict[str, tuple[tuple[Draw, int], ...]] = {
    "trajectories": ((trajectories, 2),),
    "references": ((partial(references, 0), 1), (partial(references, 1), 1)),
    "margin": ((margin, 1),),
    "gap": ((gap, 1),),
    "consensus": ((consensus, 1),),
    "multipliers": ((multipliers, 1),),
}
PAPER = ("trajectories", "references")
COLUMN, ROW = 3.6, 1.7  # [inch]; two columns fill the width of a journal page
EDGE = 0.08  # beside each panel [inch]: half a tick's label, which may stand at the very end of the axis
# Without these the file would carry the date and random names.
STYLE: Any = {"svg.hashsalt": "pbrg-mj", "font.size": 8, "legend.fontsize": 7, "pdf.fonttype": 42}
METADATA: dict[str, dict[str, Any]] = {
    ".pdf": {"CreationDate": None},
    ".png": {},
    ".svg": {"Date": None},
}


def plot(run: Run, path: Path | None = None, panels: Sequence[str] = PAPER) -> Figure:
    """Draw panels of a run as one figure; write it to `path`, .pdf, .png or .svg, if one is given.

    Raises InputError for another suffix or panel, an empty log, or when matplotlib is not installed.
    """
    metadata = {} if path is None else by_suffix(path, METADATA)
    check_panels(panels)
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("plots need matplotlib: pip install matplotlib") from error
    columns = _columns(panels)
    size = (COLUMN * len(columns), ROW * max(map(_height, columns)))
    # A diverged run overflows here; its curves end where it does.
    with matplotlib.rc_context(STYLE), np.errstate(all="ignore"):
        figure = Figure(figsize=size)
        figure.set_layout_engine("constrained", w_pad=EDGE)
        _fill(figure, columns, run)
        if path is not None:
            drawn = BytesIO()  # where a disk is full, the writer of PDF fails again and hides why
            figure.savefig(drawn, format=path.suffix.lower()[1:], dpi=200, metadata=metadata)
            write_atomically(path, lambda whole: _write(whole, drawn.getbuffer()))
    return figure


def _write(path: Path, content: memoryview) -> None:
    path.write_bytes(content)


def wanted_panels(panels: str | Sequence[str]) -> tuple[str, ...]:
    """Return the panels that are asked for: `all`, names with commas between them, or a sequence of names."""
    names = panels.split(",") if isinstance(panels, str) else panels
    return tuple(PANELS) if panels == "all" else tuple(dict.fromkeys(filter(None, names)))


def check_panels(panels: Sequence[str]) -> None:
    """Raise InputError unless there is at least one panel, and all of them exist."""
    unknown = [name for name in panels if name not in PANELS]
    if unknown or not panels:
        asked = f"there is no panel {unknown[0]!r}" if unknown else "no panel is asked for"
        raise InputError(f"{asked}; allowed: {', '.join(PANELS)}, or all")


def _columns(panels: Sequence[str]) -> list[list[str]]:
    """Return which panels stand in which column: one after the other where most space is left."""
    columns: list[list[str]] = [[] for _ in panels[:2]]
    for name in panels:
        min(columns, key=_height).append(name)
    return columns


def _height(column: list[str]) -> int:
    return sum(rows for name in column for _, rows in PANELS[name])


def _fill(figure: Figure, columns: list[list[str]], run: Run) -> None:
    grid = figure.add_gridspec(max(map(_height, columns)), len(columns))
    for place, column in enumerate(columns):
        above, row = None, 0
        for draw, rows in (part for name in column for part in PANELS[name]):
            axes = figure.add_subplot(grid[row : row + rows, place])
            draw(axes, run)
            row += rows
            if draw is trajectories:
                above = None
                continue
            if above is not None:  # one scale of time serves all that stand in a column
                above.tick_params(labelbottom=False)
                above.set_xlabel("")
            axes.set_xlabel("time [s]")
            axes.set_xlim(span(run.ticks.time))
            above = axes


def span(time: np.ndarray) -> tuple[float, float]:
    """Return the limits of an axis of time (T,) [s]."""
    first, last = float(time[0]), float(time[-1])
    return first, last if last > first else first + 1.0
