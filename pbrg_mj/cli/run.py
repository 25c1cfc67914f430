"""`pbrg run`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_scenario, log_path
from pbrg_mj.cli.arguments import Duration, Force, Overrides, ScenarioName, ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json, note
from pbrg_mj.cli.progress import progress
from pbrg_mj.cli.real_time import pacer

if TYPE_CHECKING:
    from pbrg_mj import RunMetrics, Scenario, TickRecord
    from pbrg_mj.api.profile import Profile


def run(
    scenario: ScenarioName,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="LOG.mcap", help="The log to write.")] = None,
    force: Force = False,
    seed: Annotated[int | None, typer.Option(help="Of all noise, of a family also of the world: --set seed=N.")] = None,
    duration: Duration = None,
    overrides: Overrides = None,
    json: Annotated[bool, typer.Option("--json", help="Print the metrics as JSON, and nothing else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")] = False,
    live: Annotated[bool, typer.Option("--live", help="Serve the run to Foxglove on this machine meanwhile.")] = False,
    port: Annotated[int, typer.Option(help="Of --live; 0 takes any free one.")] = 8765,
    profile: Annotated[bool, typer.Option("--profile", help="Print where the time of a tick goes.")] = False,
    processes: Annotated[
        bool, typer.Option("--processes", help="Every robot's program in a process of its own, messages over UDP.")
    ] = False,
    listen: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="As --processes, of robots that `pbrg robot` starts: wait for them."),
    ] = None,
    pace: Annotated[float | None, typer.Option(help="Simulated seconds per second at most; 1: real time.")] = None,
) -> int:
    """Run a scenario headlessly and write its log. Exit code 1 when it was violated or diverged."""
    ignore_mujoco_gl()
    wait, path = pacer(pace), output and log_path(output, force=force)  # what is wrong here need not wait for imports
    check_scenario(scenario, seed)
    loaded = pbrg.load(scenario, overrides or (), seed=seed, duration=duration)
    path = path or log_path(os.fsdecode(f"{loaded.name.rsplit('/', 1)[-1]}.mcap".encode()), force=force)
    from pbrg_mj.api.profile import Profile
    from pbrg_mj.api.simulate import record, start_robot_processes

    for line in loaded.warnings():
        note(f"warning: {line}")
    spent = Profile() if profile else None
    try:
        with (
            start_robot_processes(loaded, listen) if processes or listen else nullcontext() as robots,
            _viewers(loaded, wait, live=live, port=port, show=not quiet) as watch,
        ):
            if robots is not None and listen:
                note(f"waiting for robots 1 to {loaded.settings.robots} at {robots.mailbox.address}")
            made = record(loaded, path, force=force, watch=watch, profile=spent, robots=robots)
    except pbrg.Interrupted as error:
        note(f"interrupted; {error}")
        return 128 + error.signal
    code = _report(made, spent, json=json, quiet=quiet)
    if robots is not None and not quiet:
        note(robots.traffic_line())
    return 1 if robots is not None and robots.gone else code


@contextmanager
def _viewers(
    loaded: Scenario, wait: Callable[[TickRecord], None], *, live: bool, port: int, show: bool
) -> Iterator[list[Callable[[TickRecord], object]]]:
    """Give what is to see every record after the log: progress, who waits for the clock, a live server."""
    if live:
        with pbrg.serve(loaded, port) as serve:
            note(f"live at {serve.address}")
            with _shown(loaded, show) as shown:
                yield [shown, wait, serve]
    else:
        with _shown(loaded, show) as shown:
            yield [shown, wait]


@contextmanager
def _shown(loaded: Scenario, show: bool) -> Iterator[Callable[[TickRecord], None]]:
    with progress(loaded.settings.timing.duration, show) as shown:
        yield shown


def _report(made: RunMetrics, profile: Profile | None, *, json: bool, quiet: bool) -> int:
    from pbrg_mj.api.run import FAILED, short_summary

    if json:
        spent = {"profile_us_per_tick": profile.per_tick()} if profile else {}
        emit_json({**made.as_dict(), **spent})
    elif not quiet:
        emit(short_summary(made))
        if profile:
            emit(profile.table())
    return 1 if made.outcome in FAILED else 0
