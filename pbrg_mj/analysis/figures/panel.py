"""One panel in axes that the caller has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pbrg_mj.analysis.figures.figure import PANELS, check_panels, span
from pbrg_mj.analysis.figures.trajectories import trajectories
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OnePart = Literal["trajectories", "margin", "gap", "consensus", "multipliers"]
GAP = 0.06  # between the parts of a panel that share axes, as a share of their height


def draw_panel(run: Run, panel: str, axes: Axes | Sequence[Axes] | None) -> tuple[Axes, ...]:
    """Draw a panel of a run; return the axes of its parts, from the top down.

    `axes` are one for each part, or one that the parts share out; None makes a figure of its own.

    Raises InputError for an unknown panel, another number of axes, or when matplotlib is not installed.
    """
    check_panels([panel])
    parts = [draw for draw, _ in PANELS[panel]]
    drawn = _axes(axes, len(parts))
    # A diverged run overflows here; its curves end where it does.
    with np.errstate(all="ignore"):
        for draw, one in zip(parts, drawn, strict=True):
            draw(one, run)
            if draw is not trajectories:
                one.set_xlim(span(run.ticks.time))
    if parts[-1] is not trajectories:
        drawn[-1].set_xlabel("time [s]")
    for above in drawn[:-1]:
        above.tick_params(labelbottom=False)
    return drawn


def _axes(axes: Any, parts: int) -> tuple[Axes, ...]:
    try:
        from matplotlib import pyplot
        from matplotlib.axes import Axes
    except ImportError as error:
        raise InputError("plots need matplotlib: pip install matplotlib") from error
    if axes is None:
        made = pyplot.subplots(parts, squeeze=False, layout="constrained")[1]
        return tuple(made[:, 0])
    if isinstance(axes, Axes):
        return (axes,) if parts == 1 else _shared_out(axes, parts)
    several = tuple(np.ravel(axes))
    if len(several) != parts or not all(isinstance(one, Axes) for one in several):
        raise InputError(f"ax is {axes!r}; allowed: one of matplotlib's Axes" + (f", or {parts}" if parts > 1 else ""))
    return several


def _shared_out(axes: Axes, parts: int) -> tuple[Axes, ...]:
    """Return axes within the axes, one under the other."""
    axes.set_axis_off()
    height = (1.0 - GAP * (parts - 1)) / parts
    return tuple(axes.inset_axes((0.0, (parts - 1 - k) * (height + GAP), 1.0, height)) for k in range(parts))
