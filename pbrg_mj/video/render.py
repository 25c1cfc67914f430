"""A log to a video or a still: check, find a way to draw, draw there, encode here, give the file its name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.output_file import check_place, write_atomically
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import read_scans
from pbrg_mj.video.encode import FORMATS, STILL, SUFFIXES, need_av, write_movie, write_still
from pbrg_mj.video.gl import working_backend
from pbrg_mj.video.settings import Clip, RenderTask, ViewSettings, check_camera, check_size, frame_times, still_time
from pbrg_mj.video.worker import frames


def render_movie(run: Run, path: Path, view: ViewSettings, clip: Clip, on_frame: Callable[[], None]) -> None:
    """Render `clip` of a run into .mp4, .webm, .gif or .webp; `on_frame` is called after every frame.

    Raises InputError when something asked for cannot be, PbrgError when drawing fails; then no file is left.
    """
    check_output(path, view.size)
    times = frame_times(run.ticks.time, clip, FORMATS[path.suffix.lower()].fastest)
    task = _task(run, path, view, times)
    with _drawn(task) as pictures:
        write_atomically(path, lambda whole: write_movie(pictures, whole, clip.fps, on_frame))


def render_still(run: Run, path: Path, view: ViewSettings, at: float | None) -> None:
    """Draw the run at a time [s] (None: at its end) as .png. Raises as `render_movie` does."""
    task = _task(run, path, view, still_time(run.ticks.time, at))
    with _drawn(task) as pictures:
        write_atomically(path, lambda whole: write_still(next(pictures), whole))


def check_output(path: Path, size: tuple[int, int]) -> None:
    """Raise InputError unless the file's name and the picture's size go together, and it can be written there."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"the name ends in {suffix or 'nothing'!r}; allowed: {', '.join(SUFFIXES)}", file=str(path))
    check_size(size)
    if suffix != STILL and FORMATS[suffix].even and (size[0] % 2 or size[1] % 2):
        raise InputError(f"the size is {size[0]}x{size[1]}; {suffix} needs even numbers", file=str(path))
    check_place(path)


def _task(run: Run, path: Path, view: ViewSettings, times: np.ndarray) -> RenderTask:
    check_output(path, view.size)
    check_camera(view.camera, run.scenario.robots)
    need_av()
    scans = read_scans(run.path, run.scenario.robots) if "beams" in view.layers else {}
    return RenderTask(run, scans, view.camera, view.size, view.layers, times)


@contextmanager
def _drawn(task: RenderTask) -> Iterator[Iterator[np.ndarray]]:
    with frames(task, working_backend()) as pictures:
        yield pictures
