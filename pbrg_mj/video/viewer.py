"""A run in MuJoCo's own window, over and over, where there is a display."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Any

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import read_scans
from pbrg_mj.video.camera import camera_path
from pbrg_mj.video.markers import Markers
from pbrg_mj.video.overlay import FrameState, Overlay
from pbrg_mj.video.playback import Playback, latest, motion_of
from pbrg_mj.video.settings import LAYERS, RenderTask

SIZE = (1280, 720)  # assumed of the window [pixels]
PAUSE = 1 / 60  # [s]
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def view(run: Run, speed: float = 1.0) -> None:
    """Show the run until the window is closed; `speed` simulated seconds pass per second.

    Raises InputError without a display, or when the log's model is of no use.
    """
    _need_display()
    import mujoco.viewer

    ticks, motion = run.ticks, motion_of(run.ticks)
    playback = Playback(run, motion)
    overlay = Overlay(run, read_scans(run.path, run.scenario.robots), motion, playback.colour)
    camera = camera_path(RenderTask(run, {}, "chase", SIZE, frozenset(LAYERS), ticks.time), motion)
    first, last = float(ticks.time[0]), float(ticks.time[-1])
    shown = frozenset(LAYERS) - {"text"}
    with mujoco.viewer.launch_passive(playback.model, playback.data, show_left_ui=False, show_right_ui=False) as window:
        # The viewer's own beams are those of the model as it stands now, ours those of the log's latest scan.
        window.opt.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = False
        began = time.monotonic()
        while window.is_running():
            now = first + (time.monotonic() - began) * speed % max(last - first, PAUSE)
            _show(window, playback, overlay, FrameState(now, latest(ticks.time, now), camera(now)), shown)
            time.sleep(PAUSE)


def _show(window: Any, playback: Playback, overlay: Overlay, frame: FrameState, layers: frozenset[str]) -> None:
    with window.lock():
        playback.pose(frame.time)
        window.user_scn.ngeom = 0
        overlay.draw(Markers(window.user_scn, 1.0), frame, layers)
    window.sync()


def _need_display() -> None:
    if sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
        raise InputError(f"there is no display to open a window on (neither {' nor '.join(DISPLAYS)} is set)")
    # Where the display does not answer, the viewer would end this process without a word of ours.
    program = "import glfw, sys; sys.exit(not glfw.init())"
    if subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, check=False).returncode:
        named = ", ".join(f"{name}={os.environ[name]}" for name in DISPLAYS if os.environ.get(name))
        raise InputError(f"no window can be opened on the display ({named or 'the default one'})")
