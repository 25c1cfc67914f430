"""Videos and stills of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from pbrg_mj.api.log_reading import read_log
from pbrg_mj.errors import InputError
from pbrg_mj.video.encode import FORMATS, STILL
from pbrg_mj.video.render import ViewSettings, check_output, render_movie, render_still
from pbrg_mj.video.settings import Clip, frame_times, shown_layers

if TYPE_CHECKING:
    from pbrg_mj.api.run import Run
    from pbrg_mj.log.read.run import Run as Recorded


def render(
    run: Run | str | Path,
    path: str | Path,
    *,
    camera: str = "chase",
    size: tuple[int, int] = (1280, 720),
    fps: float | None = None,
    speed: float = 1.0,
    start: float | None = None,
    end: float | None = None,
    at: float | None = None,
    hide: Sequence[str] = (),
    progress: Callable[[int, int], object] = lambda done, frames: None,
) -> Path:
    """Render a run, or a log, offscreen as a video (.mp4, .webm, .gif, .webp), or take a still (.png); return the path.

    `camera` is chase, top or robot:K; `size` is width and height [pixels]; `fps` defaults to 30, in .gif and .webp to
    12.5; `speed` is simulated seconds per second; `start`, `end`, and of a still `at`, are times [s]; `hide` names
    layers (beams, half_spaces, formation, references, trails, text, all). `progress` is called with the frames done
    and in all.

    Raises InputError for what cannot be, PbrgError when drawing fails; then no file is left.
    """
    path = Path(path)
    view = ViewSettings(camera, size, shown_layers(tuple(hide)))
    check_output(path, size)
    suffix = path.suffix.lower()
    if suffix == STILL:
        if any(value is not None for value in (fps, start, end)) or speed != 1.0:
            raise InputError("a still has one time: give at, not fps, speed, start or end")
        with _file(run) as recorded:
            render_still(recorded, path, view, at)
        return path
    if at is not None:
        raise InputError("at is for stills (.png); a video has start and end")
    with _file(run) as recorded:
        clip = Clip(FORMATS[suffix].fps if fps is None else fps, speed, start, end)
        frames, done = len(frame_times(recorded.ticks.time, clip, FORMATS[suffix].fastest)), 0

        def each() -> None:
            nonlocal done
            done += 1
            progress(done, frames)

        progress(0, frames)
        render_movie(recorded, path, view, clip, each)
    return path


@contextmanager
def _file(run: Run | str | Path) -> Iterator[Recorded]:
    """Give a run, or a log, as recorded, with its log in a file for as long as the context lasts."""
    if isinstance(run, str | Path):
        yield read_log(run)
    else:
        with run.file() as recorded:
            yield recorded
