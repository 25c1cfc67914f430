"""Offscreen rendering: a GL context, a scene, and pixels. Only for a process that was started with MUJOCO_GL set."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from pbrg_mj.video.camera import camera_path
from pbrg_mj.video.caption import caption
from pbrg_mj.video.framing import FULL_HEIGHT, font_scale
from pbrg_mj.video.legend import Legend
from pbrg_mj.video.markers import Markers
from pbrg_mj.video.overlay import FrameState, Overlay
from pbrg_mj.video.playback import Playback, latest, motion_of
from pbrg_mj.video.settings import RenderTask

MAX_GEOMS = 12_000  # geoms in a scene: fifty robots with trails, and thousands of beams
# Pieces that round and flat things are drawn of: MuJoCo's own 28, 16 and 4 look the same and take a third longer.
SLICES, STACKS, QUADS = 24, 4, 1
AMBIENT, HEADLIGHT = 0.45, 0.22
LEGEND_HEIGHT = 360  # pictures less high have no room for a legend [pixels]


class OffscreenRenderer:
    """Draws a task's frames. A context manager; the context belongs to the thread that enters."""

    def __init__(self, task: RenderTask):
        """Set the scene. Raises InputError when the log's model is of no use."""
        self._task = task
        motion = motion_of(task.run.ticks)
        self._playback = Playback(task.run, motion)
        self._camera = camera_path(task, motion)
        self._overlay = Overlay(task.run, task.scans, motion, self._playback.colour)
        model, (width, height) = self._playback.model, task.size
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = 0  # each sample costs a software renderer as much as the whole picture
        quality = model.vis.quality
        quality.numslices, quality.numstacks, quality.numquads = SLICES, STACKS, QUADS
        model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = (
            AMBIENT,
            HEADLIGHT,
        )  # faces that no light meets, such as a wall's, stay readable
        self._scene = mujoco.MjvScene(model, MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        self._free, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = False
        self._view = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), dtype=np.uint8)

    def __enter__(self) -> Self:
        """Make the GL context."""
        self._gl = mujoco.GLContext(*self._task.size)
        self._gl.make_current()
        self._context = mujoco.MjrContext(self._playback.model, font_scale(self._task.size[1]))
        self._legend = Legend(self._task, self._context)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free the GL context."""
        self._context.free()
        self._gl.free()

    def draw(self, time: float) -> np.ndarray:
        """Return the picture (height, width, 3) at `time` [s], its rows from the BOTTOM up; valid until the next."""
        task, scene = self._task, self._scene
        self._playback.pose(time)
        mujoco.mjv_updateScene(
            self._playback.model,
            self._playback.data,
            self._option,
            None,
            self._free,
            mujoco.mjtCatBit.mjCAT_ALL,
            scene,
        )
        frame = FrameState(time, latest(task.run.ticks.time, time), self._camera(time))
        self._overlay.draw(Markers(scene, task.size[1] / FULL_HEIGHT), frame, task.layers)
        frame.camera.place(scene, task.size)
        mujoco.mjr_render(self._view, scene, self._context)
        legend = "text" in task.layers and task.size[1] >= LEGEND_HEIGHT
        if legend:
            self._legend.write(frame.camera)
        if "text" in task.layers:
            self._write(time)
        mujoco.mjr_readPixels(self._pixels, None, self._view, self._context)
        if legend:
            self._legend.paint(self._pixels)
        return self._pixels

    def _write(self, time: float) -> None:
        font, places = mujoco.mjtFont.mjFONT_NORMAL, mujoco.mjtGridPos
        mujoco.mjr_overlay(font, places.mjGRID_TOPLEFT, self._view, *caption(self._task.run, time), self._context)
