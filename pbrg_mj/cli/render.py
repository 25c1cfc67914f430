"""`pbrg render`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import PICTURES, check_logs, check_output
from pbrg_mj.cli.arguments import Force
from pbrg_mj.errors import InputError

STILL = ".png"


def render(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log to render.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="VIDEO", help="VIDEO.mp4, .webm, .gif, .webp, or a still, .png.")
    ],
    camera: Annotated[str, typer.Option(help="chase, top, or robot:K, over robot K's shoulder.")] = "chase",
    size: Annotated[str, typer.Option(help="Width and height [pixels].")] = "1280x720",
    fps: Annotated[float | None, typer.Option(help="Frames per second.", show_default="30; .gif, .webp: 12.5")] = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second of video.")] = 1.0,
    start: Annotated[float | None, typer.Option(help="Start of the video [s].")] = None,
    end: Annotated[float | None, typer.Option(help="End of the video [s].")] = None,
    at: Annotated[float | None, typer.Option(help="Time of a still [s].", show_default="the last tick")] = None,
    hide: Annotated[
        str, typer.Option(metavar="LAYERS", help="beams,half_spaces,formation,references,trails,text or all.")
    ] = "",
    force: Force = False,
) -> None:
    """Render a log offscreen as a video, or take a still of it."""
    still = output.suffix.lower() == STILL
    if still and (speed != 1.0 or any(value is not None for value in (fps, start, end))):
        raise InputError("a still has one time: give --at, not --fps, --speed, --start or --end")
    if at is not None and not still:
        raise InputError("--at is for stills (.png); a video has --start and --end")
    check_logs(log)
    check_output(output, PICTURES, force=force)
    hidden = tuple(filter(None, hide.split(",")))
    with _progress(wanted=not still) as shown:
        pbrg.render(
            log,
            output,
            camera=camera,
            size=_size(size),
            fps=fps,
            speed=speed,
            start=start,
            end=end,
            at=at,
            hide=hidden,
            progress=shown,
        )


def _size(text: str) -> tuple[int, int]:
    width, by, height = text.partition("x")
    if not (by and all(side.isascii() and side.isdigit() and len(side) < 6 for side in (width, height))):
        raise InputError(f"the size is {text!r}; it is written like 1280x720")
    return int(width), int(height)


@contextmanager
def _progress(*, wanted: bool) -> Iterator[Callable[[int, int], None]]:
    """Give a function to call with the frames done and in all. It does nothing unless stderr is a terminal."""
    if not wanted or not sys.stderr.isatty():
        yield lambda _done, _frames: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn("frames,"), TimeRemainingColumn())
    with Progress(*columns, TextColumn("left"), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, frames: bar.update(task, completed=done, total=frames)
