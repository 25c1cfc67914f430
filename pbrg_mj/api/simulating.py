"""From a scenario to a run: to its end into a log or into memory, or tick by tick."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pbrg_mj.api.garbage import collecting_rarely
from pbrg_mj.api.interrupt import Interrupted, interruptible
from pbrg_mj.api.profile import Profile
from pbrg_mj.api.runs import IN_MEMORY, Run
from pbrg_mj.api.runs import open as open_log
from pbrg_mj.api.scenarios import Scenario, as_scenario
from pbrg_mj.errors import InputError
from pbrg_mj.governor.problem.interface import Governor
from pbrg_mj.governor.registry import object_kind
from pbrg_mj.kernel import clock as clock  # for the command line
from pbrg_mj.kernel import watching_compilation as watching_compilation
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter, check_writable
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation

if TYPE_CHECKING:
    from pbrg_mj.log.live import LiveServer

Sink = Callable[[TickRecord], object]


def run(
    scenario: Scenario | str | Path,
    governor: Governor | None = None,
    log: str | Path | None = None,
    *,
    watch: Iterable[Sink] = (),
    profile: Profile | None = None,
) -> Run:
    """Simulate a scenario to its end and return the run.

    `governor`, any object with `init(problem)` and `step(problem, memory)`, takes the place of the scenario's own;
    the log then names its class. `log` is the file (.mcap) to write; None keeps the run in memory. Every function in
    `watch` is called with each tick's record once that is in the log, and `profile` last, which adds up where the time
    goes.

    Ctrl-C ends the run between two ticks, with a log that is whole so far, and raises Interrupted. Raises InputError
    when the scenario or the governor cannot be run, or the log cannot be written.
    """
    scenario = with_governor(as_scenario(scenario), governor)
    path = None if log is None else log_path(log)
    simulation = Simulation.build(scenario.settings, governor)
    with collecting_rarely():
        if path is not None:
            _record(simulation, scenario, path, watch, profile)
            return open_log(path)
        with tempfile.TemporaryDirectory(prefix="pbrg-") as folder:
            path = Path(folder) / "run.mcap"
            _record(simulation, scenario, path, watch, profile)
            return Run(replace(open_run(path), path=IN_MEMORY), path.read_bytes())


def simulate(scenario: Scenario | str | Path, governor: Governor | None = None) -> Iterator[TickRecord]:
    """Return an iterator over the run's ticks, one record each, from t = 0 to t = duration. No log is written.

    Arguments and errors are those of `run`.
    """
    scenario = with_governor(as_scenario(scenario), governor)
    return Simulation.build(scenario.settings, governor).records()


def serve(scenario: Scenario | str | Path, port: int = 8765) -> LiveServer:
    """Return a live server for Foxglove on this machine, a context manager to hand to `run` among those who watch.

    It has its `address`; port 0 takes any free one. Raises InputError when the port is taken.
    """
    from pbrg_mj.log.live import LiveServer

    return LiveServer(as_scenario(scenario).settings, port)


def log_path(path: str | Path) -> Path:
    """Return the path of a log to write. Raises InputError when it is not .mcap, or cannot be written."""
    path = Path(path)
    if path.suffix != ".mcap":
        raise InputError("a log's name ends in .mcap", file=str(path))
    check_writable(path)  # before the simulation is built, which takes longer
    return path


def with_governor(scenario: Scenario, governor: Governor | None) -> Scenario:
    """Return the scenario with the object's class as its `governor.kind`.

    Raises InputError for an object that is no governor.
    """
    if governor is None:
        return scenario
    if isinstance(governor, type) or not all(callable(getattr(governor, name, None)) for name in ("init", "step")):
        raise InputError(
            f"{governor!r} is no governor; allowed: an object with init(problem) and step(problem, memory)"
        )
    return scenario.override({"governor.kind": object_kind(governor)})


def _record(
    simulation: Simulation, scenario: Scenario, path: Path, watch: Iterable[Sink], profile: Profile | None
) -> None:
    """Simulate into a log, which is closed and whole so far when this raises Interrupted."""
    with interruptible() as pressed, LogWriter(path, scenario.loaded, simulation.model_xml) as write:
        sinks = (profile.timed("log", write) if profile else write, *watch, *([profile] if profile else []))
        for record in simulation.records():
            for sink in sinks:
                sink(record)
            if pressed():
                raise Interrupted(f"the log so far: {path}")
