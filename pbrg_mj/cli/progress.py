"""Progress of a run on a terminal: simulated time, speed against real time, outcome so far."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pbrg_mj.cli.console import note

if TYPE_CHECKING:
    from pbrg_mj import TickRecord

REFRESH = 0.1  # [s] wall clock between updates


class RunningSummary:
    """A running summary of the records seen."""

    def __init__(self) -> None:
        self.problem = ""
        self.touched = False
        self.margin = float("inf")  # [m]

    def add(self, record: TickRecord) -> None:
        """Take one record into account; the first problem stays."""
        truth = record.truth
        self.margin = min(self.margin, float(truth.wall_margin.min()), float(truth.moving_margin.min()))
        contacts = {
            "a wall": truth.wall_contact,
            "a moving box": truth.moving_contact,
            "another robot": truth.robot_contact,
        }
        touched = next((what for what, flags in contacts.items() if flags.any()), None)
        if touched and not self.touched:
            self.touched, self.problem = True, f"a robot touched {touched} at {record.time:.1f} s"
        elif self.margin < 0 and not self.touched:
            self.problem = "past a line"
        elif record.solution.status != "ok" and not self.problem:
            self.problem = f"governor {record.solution.status} at {record.time:.1f} s"

    def text(self) -> str:
        """Return it in a few words."""
        margin = f"margin {self.margin:.3f} m" if self.margin < float("inf") else ""
        return ", ".join(part for part in (self.problem or "no violation", margin) if part)


@contextmanager
def compiling_noted() -> Iterator[None]:
    """Say on a terminal, once, why nothing seems to happen while kernels are compiled."""
    from pbrg_mj.api.simulate import watching_compilation

    announced = not sys.stderr.isatty()

    def compiling(kernel: str | None) -> None:
        nonlocal announced
        if kernel and not announced:
            note("compiling kernels, once per version of the code: up to half a minute")
        announced = True

    with watching_compilation(compiling):
        yield


@contextmanager
def progress(duration: float, wanted: bool) -> Iterator[Callable[[TickRecord], None]]:
    """Give a function to call with every record. It does nothing unless stderr is a terminal."""
    if not wanted or not sys.stderr.isatty():
        yield lambda _record: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from pbrg_mj.api.simulate import clock, watching_compilation

    columns = (BarColumn(bar_width=20), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=duration)
        so_far, began, shown, compiled = RunningSummary(), None, 0.0, 0

        def compiling(kernel: str | None) -> None:
            nonlocal compiled
            compiled += kernel is not None
            text = f"compiling kernels, once per version of the code: {compiled}, {kernel}" if kernel else "starting"
            bar.update(task, description=text, refresh=True)

        def show(record: TickRecord) -> None:
            nonlocal began, shown
            so_far.add(record)
            began = began or clock()  # the first record comes after all that must be built
            elapsed = clock() - began
            if elapsed - shown >= REFRESH:
                shown = elapsed
                speed = f"{record.time / elapsed:.1f} x real time"
                text = f"{record.time:.1f} of {duration:g} s, {speed}, {so_far.text()}"
                bar.update(task, completed=record.time, description=text)

        with watching_compilation(compiling):
            yield show
