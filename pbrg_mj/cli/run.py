"""`pbrg run`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrg_mj.api.garbage import settle
from pbrg_mj.api.interrupt import interruptible
from pbrg_mj.api.profile import Profile
from pbrg_mj.cli.compare import open_log
from pbrg_mj.cli.console import emit, emit_json, note
from pbrg_mj.cli.pace import pacer
from pbrg_mj.cli.progress import progress
from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.loop.record import TickRecord
    from pbrg_mj.scenario.load import Loaded

FAILED = {"violated", "diverged"}
INTERRUPTED = 130


def run(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A file, or a bundled name (see: pbrg list).")],
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="LOG.mcap", help="The log to write.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all noise: --set seed=N.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time [s]: --set timing.duration=S.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change path.to.key; may be repeated.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the metrics as JSON, and nothing else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")] = False,
    live: Annotated[bool, typer.Option("--live", help="Serve the run to Foxglove on this machine meanwhile.")] = False,
    port: Annotated[int, typer.Option(help="Of --live; 0 takes any free one.")] = 8765,
    profile: Annotated[bool, typer.Option("--profile", help="Print where the time of a tick goes.")] = False,
    pace: Annotated[float | None, typer.Option(help="Simulated seconds per second at most; 1: real time.")] = None,
) -> int:
    """Run a scenario headlessly and write its log. Exit code 1 when it was violated or diverged."""
    # Where MUJOCO_GL names a library that is missing, MuJoCo would not even start; nothing here draws.
    os.environ.pop("MUJOCO_GL", None)
    from pbrg_mj.loop.stability_warnings import stability_warnings
    from pbrg_mj.scenario.load import load_scenario

    loaded = load_scenario(scenario, [*(overrides or ()), *_shorthands(seed, duration)])
    path = _log_path(output, loaded.name)
    for line in stability_warnings(loaded.scenario):
        note(f"warning: {line}")
    with viewers(loaded, live=live, port=port, pace=pace) as watched:
        spent = Profile() if profile else None
        finished = record(loaded, path, show=not quiet, watched=watched, profile=spent)
    if not finished:
        note(f"interrupted; the log so far: {path}")
        return INTERRUPTED
    return _report(path, spent, json=json, quiet=quiet)


def _shorthands(seed: int | None, duration: float | None) -> list[str]:
    settings = {"seed": seed, "timing.duration": duration}
    return [f"{key}={value}" for key, value in settings.items() if value is not None]


def _log_path(output: Path | None, name: str) -> Path:
    from pbrg_mj.log.write.writer import check_writable

    path = output or Path(f"{name.rsplit('/', 1)[-1]}.mcap")
    if path.suffix != ".mcap":
        raise InputError("a log's name ends in .mcap", file=str(path))
    check_writable(path)  # before the simulation is built, which takes longer
    return path


@contextmanager
def viewers(
    loaded: Loaded, *, live: bool, port: int, pace: float | None
) -> Iterator[tuple[Callable[[TickRecord], None], ...]]:
    """Give what is to see every record after the log: a live server, and who waits for the clock."""
    wait = pacer(pace)
    if not live:
        yield (wait,)
        return
    from pbrg_mj.log.live import LiveServer

    with LiveServer(loaded.scenario, port) as serve:
        note(f"live at {serve.address}")
        yield (wait, serve)


def record(
    loaded: Loaded,
    path: Path,
    *,
    show: bool,
    watched: tuple[Callable[[TickRecord], None], ...] = (),
    profile: Profile | None = None,
) -> bool:
    """Simulate into the log; False when interrupted. The log is closed and whole either way.

    What is in `watched` sees every record once it is in the log, and the profile when everybody has seen it.
    """
    from pbrg_mj.kernel import cache_folder
    from pbrg_mj.log.write.writer import LogWriter
    from pbrg_mj.loop.simulation import Simulation

    if show and sys.stderr.isatty() and not cache_folder().exists():
        note("compiling kernels, once per version: up to a minute")
    simulation = Simulation.build(loaded.scenario)
    settle()
    with (
        interruptible() as pressed,
        LogWriter(path, loaded, simulation.model_xml) as write,
        progress(loaded.scenario.timing.duration, show) as shown,
    ):
        sinks = (profile.timed("log", write) if profile else write, shown, *watched, *([profile] if profile else []))
        for record in simulation.records():
            for see in sinks:
                see(record)
            if pressed():
                return False
    return True


def _report(path: Path, profile: Profile | None, *, json: bool, quiet: bool) -> int:
    from pbrg_mj.analysis.metrics.run_metrics import metrics
    from pbrg_mj.analysis.metrics.table import short_summary

    numbers = metrics(open_log(path))
    if json:
        spent = {"profile_us_per_tick": profile.per_tick()} if profile else {}
        emit_json({**numbers.as_dict(), **spent})
    elif not quiet:
        emit(short_summary(numbers))
        if profile:
            emit(profile.table())
    return 1 if numbers.outcome in FAILED else 0
