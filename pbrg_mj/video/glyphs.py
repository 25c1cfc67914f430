"""The legend's glyphs: what each mark of a picture looks like, in small, and which of them a run's pictures have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.scenario.schema import edge_list
from pbrg_mj.video.overlay import EDGE_COLOUR, OPTIMUM_COLOUR, REFERENCE_COLOUR, STAR_ANGLES, TRAIL_SECONDS
from pbrg_mj.video.settings import RenderTask

Colour = tuple[float, float, float]
DISC: Colour = (0.28, 0.60, 0.90)  # any robot's
PALE: Colour = (0.72, 0.84, 0.95)
WIDE, THIN = 0.18, 0.1  # half the widths of bars, as a share of the glyph's half side
REACH = 0.95  # of a glyph's radius, squared


class Glyph(NamedTuple):
    """A disc, or bars through the middle; and what else is drawn with it."""

    colour: Colour
    angles: tuple[float, ...] = ()  # of the bars [rad], none for a disc
    width: float = WIDE  # of bars
    side: Colour | None = None  # of the half below the bars, if that is shaded
    end: bool = False  # whether the bars end in a dot
    bent: bool = False  # whether the bars are arcs


GLYPHS = {
    "r": Glyph(REFERENCE_COLOUR[:3], tuple(STAR_ANGLES)),
    "m*": Glyph(OPTIMUM_COLOUR[:3], (np.pi / 4, 3 * np.pi / 4)),
    "m_i": Glyph(DISC),
    "m_i + b_i": Glyph(PALE),
    "half-space": Glyph(DISC, (0.0,), side=PALE),
    "beam": Glyph(DISC, (np.pi / 4,), THIN, end=True),
    f"trail, {TRAIL_SECONDS:g} s": Glyph(DISC, (0.0,), bent=True),
    "network": Glyph(EDGE_COLOUR[:3], (0.0,), THIN),
}
LAYER = dict(zip(GLYPHS, [*["references"] * 4, "half_spaces", "beams", "trails", "formation"], strict=True))


def legend_names(task: RenderTask) -> list[str]:
    """Return the marks that a task's pictures show, from the top down; a layer that stays empty has none."""
    run, scenario = task.run, task.run.scenario
    empty = {
        "m*": not len(run.optima.time),
        "half-space": not run.ticks.half_space_active.any(),
        "beam": not task.scans,
        "network": not len(edge_list(scenario.graph, scenario.robots)),
    }
    return [name for name in GLYPHS if LAYER[name] in task.layers and not empty.get(name, False)]


def glyph_picture(glyph: Glyph, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return where a glyph is drawn (size, size), and its colours (size, size, 3), rows from the bottom up."""
    across = (np.arange(size) - (size - 1) / 2) / (size / 2)
    x, y = np.meshgrid(across, across)
    inside = x**2 + y**2 <= REACH
    colour = np.broadcast_to(np.array(glyph.colour), (size, size, 3)).copy()
    if not glyph.angles:
        return inside, colour
    height = y - (0.8 * x**2 - 0.4 if glyph.bent else 0.0)
    off = [np.abs(np.sin(angle) * x - np.cos(angle) * height) for angle in glyph.angles]
    bars = np.min(off, axis=0) <= glyph.width
    mask = inside & bars
    if glyph.end:
        (angle,) = glyph.angles
        mask |= np.hypot(x - 0.7 * np.cos(angle), y - 0.7 * np.sin(angle)) <= 2.5 * glyph.width
    if glyph.side is not None:
        below = (np.abs(x) <= REACH) & (y < 0) & ~bars
        colour[below] = glyph.side
        mask |= below
    return mask, colour
