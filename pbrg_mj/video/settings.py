"""What to draw: the frames' times, the camera, the layers; checked before anything is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, isfinite

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import ScanSeries

LAYERS = ("beams", "half_spaces", "formation", "references", "trails", "text")
CAMERAS = ("top", "chase")
ROBOT_CAMERA = "robot:"
SMALLEST, LARGEST = 64, 4096  # [pixels]
SLOWEST = 0.001  # frames per second, and simulated seconds per second
ROUNDING = 1e-9  # share of a frame


@dataclass(frozen=True)
class ViewSettings:
    """The camera, the size and the layers of a picture."""

    camera: str = "chase"  # chase, top, robot:<k>
    size: tuple[int, int] = (1280, 720)  # [pixels]
    layers: frozenset[str] = frozenset(LAYERS)


@dataclass(frozen=True)
class Clip:
    """The part of a run to show, and how fast. None: from the first tick, to the last one."""

    fps: float = 30.0  # [frames/s]
    speed: float = 1.0  # simulated seconds per second of video
    start: float | None = None  # [s]
    end: float | None = None  # [s]


@dataclass(frozen=True)
class RenderTask:
    """All that the drawing process needs to know."""

    run: Run
    scans: dict[int, ScanSeries]  # by robot, from 0
    camera: str
    size: tuple[int, int]  # width, height [pixels]
    layers: frozenset[str]
    times: np.ndarray  # (frames,) [s] in the run


def check_camera(camera: str, robots: int) -> None:
    """Raise InputError unless `camera` is top, chase or robot:<1..n>."""
    number = camera.removeprefix(ROBOT_CAMERA)
    mounted = number != camera and number.isascii() and number.isdigit() and 1 <= int(number) <= robots
    if camera not in CAMERAS and not mounted:
        raise InputError(f"there is no camera {camera!r}; allowed: {', '.join(CAMERAS)}, robot:1 to robot:{robots}")


def check_size(size: tuple[int, int]) -> None:
    """Raise InputError unless both sides are of a sensible length."""
    if not all(SMALLEST <= side <= LARGEST for side in size):
        raise InputError(f"the size is {size[0]}x{size[1]}; allowed: {SMALLEST} to {LARGEST} pixels each way")


def shown_layers(hidden: tuple[str, ...]) -> frozenset[str]:
    """Return the layers left when the `hidden` ones ('all': every one) are switched off."""
    unknown = [name for name in hidden if name not in (*LAYERS, "all")]
    if unknown:
        raise InputError(f"there is no layer {unknown[0]!r} to hide; allowed: {', '.join(LAYERS)}, all")
    return frozenset() if "all" in hidden else frozenset(LAYERS) - set(hidden)


def frame_times(time: np.ndarray, cut: Clip, fastest: float) -> np.ndarray:
    """Return the simulated time of every frame; `time` (T,) [s] are the log's ticks.

    `fastest` [frames/s] is the most the format can hold. Raises InputError.
    """
    for name, value, largest in (("fps", cut.fps, fastest), ("speed", cut.speed, 1000.0)):
        if not SLOWEST <= value <= largest:
            raise InputError(f"the {name} is {value:g}; allowed: {SLOWEST:g} to {largest:g}")
    first, last = float(time[0]), float(time[-1])
    start = first if cut.start is None else cut.start
    end = last if cut.end is None else min(cut.end, last)
    _check_within(start, first, last)
    if not end >= start:
        raise InputError(f"the end is {end:g} s; allowed: from the start, {start:g} s, on")
    count = max(1, ceil((end - start) * cut.fps / cut.speed - ROUNDING))
    return start + np.arange(count) * (cut.speed / cut.fps)


def still_time(time: np.ndarray, at: float | None) -> np.ndarray:
    """Return the one time (1,) [s] of a still; None: the last tick. Raises InputError."""
    first, last = float(time[0]), float(time[-1])
    wanted = last if at is None else at
    _check_within(wanted, first, last)
    return np.array([wanted])


def _check_within(time: float, first: float, last: float) -> None:
    if not (isfinite(time) and first <= time <= last + ROUNDING):
        raise InputError(f"the time is {time:g} s; the log has {first:g} to {last:g} s")
