"""What the marks in a picture mean, each with its own glyph, and how long a metre is."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.video.camera import Camera
from pbrg_mj.video.glyphs import GLYPHS, glyph_picture, legend_names
from pbrg_mj.video.settings import RenderTask

TILE = 1.0  # side of the floor's squares in models/arena.xml [m]
BACKGROUND, TEXT = (0.0, 0.0, 0.0, 0.3), (1.0, 1.0, 1.0)
SCALE_SHARE = 0.75  # of the picture's width, of which the scale bar takes a fifth at most: it stays in its column


def scale_length(width: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten [m] that is at most a fifth of a picture's width [m]."""
    power = 10.0 ** np.floor(np.log10(width / 5))
    return float(max(step * power for step in (1, 2, 5) if step * power <= width / 5 * (1 + 1e-9)))


class Legend:
    """Draws itself into the lower left corner of pictures of one size."""

    def __init__(self, task: RenderTask, context: mujoco.MjrContext):
        """`context` is the GL context's."""
        self._names, self._size, self._context = legend_names(task), task.size, context
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
            mask, colours = glyph_picture(GLYPHS[name], size)
            bottom, left = self._bottom(row, len(self._names) + 1), self._line // 2
            part = pixels[bottom : bottom + size, left : left + size]
            mask = mask[: len(part), : part.shape[1]]
            part[mask] = np.round(255 * colours[: len(part), : part.shape[1]][mask])

    def _bottom(self, row: int, rows: int) -> int:
        return self._line // 2 + self._line * (rows - 1 - row)

    def _scale(self, camera: Camera) -> tuple[int, str]:
        """Return the scale bar's length [pixels] and its words; 0 where lengths shrink with distance."""
        width, height = self._size
        if not camera.orthographic:
            return 0, f"floor squares {TILE:g} m"
        metre = height / 2 / camera.half_height  # [pixels]
        length = scale_length(SCALE_SHARE * width / metre)
        return round(length * metre), f"{length:g} m"

    def _text(self, words: str, left: int, bottom: int) -> None:
        width, height = self._size
        font = mujoco.mjtFont.mjFONT_NORMAL
        mujoco.mjr_text(font, words, self._context, left / width, bottom / height, *TEXT)
