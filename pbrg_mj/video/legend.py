"""What the marks in a picture mean, each with its own glyph, and how long a metre is."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.log.read.run import Run
from pbrg_mj.video.camera import Camera
from pbrg_mj.video.overlay import OPTIMUM_COLOUR, REFERENCE_COLOUR, STAR_ANGLES

Colour = tuple[float, float, float]
TILE = 1.0  # side of the floor's squares in models/arena.xml [m]
DISC: Colour = (0.28, 0.60, 0.90)  # any robot's
PALE: Colour = (0.72, 0.84, 0.95)
BACKGROUND, TEXT = (0.0, 0.0, 0.0, 0.3), (1.0, 1.0, 1.0)
GLYPHS: dict[str, tuple[np.ndarray, Colour]] = {  # angles of crossing bars [rad], none for a disc; colour
    "r": (STAR_ANGLES, REFERENCE_COLOUR[:3]),
    "m*": (np.pi * np.array([0.25, 0.75]), OPTIMUM_COLOUR[:3]),
    "m_i": (np.empty(0), DISC),
    "m_i + b_i": (np.empty(0), PALE),
}


def legend_names(run: Run) -> list[str]:
    """Return the marks that a run's pictures show, from the top down."""
    return [name for name in GLYPHS if name != "m*" or len(run.optima.time)]


def scale_length(width: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten [m] that is at most a fifth of a picture's width [m]."""
    power = 10.0 ** np.floor(np.log10(width / 5))
    return float(max(step * power for step in (1, 2, 5) if step * power <= width / 5 * (1 + 1e-9)))


def glyph_mask(angles: np.ndarray, size: int) -> np.ndarray:
    """Return where a glyph (size, size) has its colour: bars at `angles` [rad] through the middle, or a disc."""
    across = (np.arange(size) - (size - 1) / 2) / (size / 2)
    x, y = np.meshgrid(across, across)
    inside = x**2 + y**2 <= 0.9
    if not len(angles):
        return inside
    return inside & (np.abs(np.outer(np.sin(angles), x) - np.outer(np.cos(angles), y)) <= 0.18).any(axis=0).reshape(
        x.shape
    )


class Legend:
    """Draws itself into the lower left corner of pictures of one size."""

    def __init__(self, run: Run, size: tuple[int, int], context: mujoco.MjrContext):
        """`context` is the GL context's."""
        self._names, self._size, self._context = legend_names(run), size, context
        self._line = int(context.charHeight * 1.25)

    def write(self, camera: Camera) -> None:
        """Draw background, names and scale bar."""
        scale = self._scale(camera)
        lines = [*self._names, scale[1]]
        width = self._line * 2 + max(int(np.sum(self._context.charWidth[[ord(c) for c in line]])) for line in lines)
        width = max(width, self._line * 2 + scale[0])
        mujoco.mjr_rectangle(mujoco.MjrRect(0, 0, width, self._line * (len(lines) + 1)), *BACKGROUND)
        if scale[0]:
            bottom = self._line // 4
            mujoco.mjr_rectangle(mujoco.MjrRect(self._line // 2, bottom, scale[0], max(self._line // 6, 2)), *TEXT, 1.0)
        mujoco.mjr_rectangle(mujoco.MjrRect(0, 0, *self._size), 0.0, 0.0, 0.0, 0.0)  # text goes by the last viewport
        for row, line in enumerate(lines):
            left = self._line // 2 if row == len(lines) - 1 else self._line * 2
            self._text(line, left, self._bottom(row, len(lines)))

    def paint(self, pixels: np.ndarray) -> None:
        """Paint the glyphs into a picture (height, width, 3) whose rows go from the bottom up."""
        size = self._line * 3 // 4
        for row, name in enumerate(self._names):
            angles, colour = GLYPHS[name]
            bottom, left = self._bottom(row, len(self._names) + 1), self._line // 2
            part = pixels[bottom : bottom + size, left : left + size]
            mask = glyph_mask(angles, size)[: len(part), : part.shape[1]]
            part[mask] = np.round(255 * np.array(colour))

    def _bottom(self, row: int, rows: int) -> int:
        return self._line // 2 + self._line * (rows - 1 - row)

    def _scale(self, camera: Camera) -> tuple[int, str]:
        """Return the scale bar's length [pixels] and its words; 0 where lengths shrink with distance."""
        width, height = self._size
        if not camera.orthographic:
            return 0, f"floor squares {TILE:g} m"
        metre = height / 2 / camera.half_height  # [pixels]
        length = scale_length(width / metre)
        return round(length * metre), f"{length:g} m"

    def _text(self, words: str, left: int, bottom: int) -> None:
        width, height = self._size
        font = mujoco.mjtFont.mjFONT_NORMAL
        mujoco.mjr_text(font, words, self._context, left / width, bottom / height, *TEXT)
