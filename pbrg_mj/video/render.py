"""A log to a video or a still: check, find a way to draw, draw there, encode here, give the file its name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.output_file import write_atomically
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import read_scans
from pbrg_mj.video.encode import FORMATS, STILL, SUFFIXES, need_av, write_movie, write_still
from pbrg_mj.video.gl import working_backend
from pbrg_mj.video.settings import LAYERS, Clip, RenderTask, check_camera, check_size, frame_times, still_time
from pbrg_mj.video.worker import frames


@dataclass(frozen=True)
class ViewSettings:
    """How to look at a run."""

    camera: str = "chase"  # chase, top, robot:<k>
    size: tuple[int, int] = (1280, 720)  # [pixels]
    layers: frozenset[str] = frozenset(LAYERS)


def render_movie(run: Run, path: Path, view: ViewSettings, cut: Clip, each: Callable[[], None]) -> None:
    """Film `cut` of a run into .mp4, .webm or .gif; `each` is called after every frame.

    Raises InputError when something asked for cannot be, PbrgError when drawing fails; then no file is left.
    """
    check_output(path, view.size)
    times = frame_times(run.ticks.time, cut, FORMATS[path.suffix.lower()].fastest)
    job = _job(run, path, view, times)
    with _drawn(job) as pictures:
        write_atomically(path, lambda whole: write_movie(pictures, whole, cut.fps, each))


def render_still(run: Run, path: Path, view: ViewSettings, at: float | None) -> None:
    """Draw the run at a time [s] (None: at its end) as .png. Raises as `render_movie` does."""
    job = _job(run, path, view, still_time(run.ticks.time, at))
    with _drawn(job) as pictures:
        write_atomically(path, lambda whole: write_still(next(pictures), whole))


def check_output(path: Path, size: tuple[int, int]) -> None:
    """Raise InputError unless the file's name and the picture's size go together."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"the name ends in {suffix or 'nothing'!r}; allowed: {', '.join(SUFFIXES)}", file=str(path))
    check_size(size)
    if suffix != STILL and FORMATS[suffix].even and (size[0] % 2 or size[1] % 2):
        raise InputError(f"the size is {size[0]}x{size[1]}; {suffix} needs even numbers", file=str(path))


def _job(run: Run, path: Path, view: ViewSettings, times: np.ndarray) -> RenderTask:
    check_output(path, view.size)
    check_camera(view.camera, run.scenario.robots)
    need_av()
    scans = read_scans(run.path, run.scenario.robots) if "beams" in view.layers else {}
    return RenderTask(run, scans, view.camera, view.size, view.layers, times)


@contextmanager
def _drawn(job: RenderTask) -> Iterator[Iterator[np.ndarray]]:
    with frames(job, working_backend()) as pictures:
        yield pictures
