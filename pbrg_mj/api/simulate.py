"""From a scenario to a run: to its end into a log or into memory, or tick by tick."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pbrg_mj.analysis.metrics.record_metrics import RecordMetrics
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.api.files import log_path
from pbrg_mj.api.garbage_collection import collecting_rarely
from pbrg_mj.api.interrupt import Interrupted, interruptible
from pbrg_mj.api.log_reading import LOG
from pbrg_mj.api.logs import metrics_of
from pbrg_mj.api.logs import open as open_log
from pbrg_mj.api.profile import Profile
from pbrg_mj.api.run import IN_MEMORY, Run
from pbrg_mj.api.scenario import Scenario, as_scenario
from pbrg_mj.errors import InputError
from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.messaging.program import RobotProgram
from pbrg_mj.governor.problem.interface import Certificate, Governor
from pbrg_mj.kernel import clock as clock  # for the command line
from pbrg_mj.kernel import watching_compilation as watching_compilation
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.certificate_warnings import certificate_warnings
from pbrg_mj.loop.governor_warnings import governor_warnings
from pbrg_mj.loop.network_warnings import network_warnings
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.estimator import Estimator
from pbrg_mj.plugins import Objects, object_overrides
from pbrg_mj.sensing.noise_model import NoiseModel

if TYPE_CHECKING:
    from pbrg_mj.log.live import LiveServer
    from pbrg_mj.transport.team import RobotProcesses

Sink = Callable[[TickRecord], object]


def run(
    scenario: Scenario | str | Path,
    governor: Governor | RobotProgram | None = None,
    log: str | Path | None = None,
    *,
    force: bool = False,
    certificate: Certificate | None = None,
    estimator: Estimator | None = None,
    noise_model: NoiseModel | None = None,
    reference_solver: CentralizedSolver | None = None,
    watch: Iterable[Sink] = (),
    profile: Profile | None = None,
    processes: bool = False,
) -> Run:
    """Simulate a scenario to its end and return the run.

    `governor` takes the place of the scenario's own; the log then names its class. A `RobotProgram` is run on every
    robot, each with a copy of its own, and its messages are carried; an object with `init(problem)` and
    `step(problem, memory)` sees the whole team and counts as centralized. `certificate`, `estimator`, `noise_model` and
    `reference_solver` take the scenario's place likewise (docs/governor.md says what each must offer). `log` is the
    file (.mcap) to write, and `force` allows to replace one that exists; None keeps the run in memory. Every function
    in `watch` is called with each tick's record once that is in the log, and `profile` last, which adds up where the
    time goes. With `processes` every robot's program runs in a process of its own, and its messages go over UDP
    (docs/hardware.md); nothing may then take the scenario's place.

    Ctrl-C, SIGTERM and SIGHUP end the run between two ticks, with a log that is whole so far, and raise Interrupted.
    Raises InputError when the scenario or the governor cannot be run, or the log cannot be written; PlugInError when a
    part of another package, or an object, does not keep its contract.
    """
    objects = Objects(governor, certificate, estimator, noise_model, reference_solver)
    scenario = with_objects(as_scenario(scenario), objects)
    _warn(scenario, governor)
    path = None if log is None else log_path(log, force=force)
    if processes and objects != Objects():
        raise InputError("processes of robots run what the scenario names; allowed: no objects in its place")
    simulation = Simulation.build(scenario.settings, objects)
    with collecting_rarely(), start_robot_processes(scenario) if processes else nullcontext() as robots:
        if robots is not None:
            simulation = _governed_apart(simulation, robots)
        if path is not None:
            _record(simulation, scenario, path, force, watch, profile, processes)
            return open_log(path)
        with tempfile.TemporaryDirectory(prefix="pbrg-") as folder:
            path = Path(folder) / "run.mcap"
            _record(simulation, scenario, path, False, watch, profile, processes)
            return Run(replace(open_run(path), path=IN_MEMORY), path.read_bytes())


def record(
    scenario: Scenario,
    log: Path,
    *,
    force: bool = False,
    watch: Iterable[Sink] = (),
    profile: Profile | None = None,
    robots: RobotProcesses | None = None,
) -> RunMetrics:
    """Simulate a scenario into a log and return the run's metrics; the run itself is never held.

    `robots` are those of `start_robot_processes`. The other arguments and errors are those of `run`.
    """
    path, simulation = log_path(log, force=force), Simulation.build(scenario.settings)
    if robots is not None:
        simulation = _governed_apart(simulation, robots)
    with collecting_rarely():
        _record(simulation, scenario, path, force, watch, profile, robots is not None)
    return metrics_of(path)


def measure(scenario: Scenario) -> RunMetrics:
    """Simulate a scenario and return the metrics that its log would have; no log is written.

    Raises what `record` raises but for the log.
    """
    simulation = Simulation.build(scenario.settings)
    sink = RecordMetrics(scenario.settings, scenario.name, centralized=simulation.centralized)
    with collecting_rarely(), interruptible() as came:
        for one in simulation.records():
            sink(one)
            if number := came():
                raise Interrupted("the run has no log", number)
    return sink.metrics()


def start_robot_processes(scenario: Scenario, listen: str | None = None) -> AbstractContextManager[RobotProcesses]:
    """Give a scenario's robots in processes of their own, which end with the context.

    `listen`, an address `HOST:PORT` of this machine: start none, and wait there for those of `run_robot`. Raises
    InputError for a governor that robots do not run themselves, or an address that cannot be taken.
    """
    from pbrg_mj.transport.address import Address
    from pbrg_mj.transport.children import robot_processes

    return robot_processes(scenario.settings, scenario.yaml, Address.of(listen) if listen else None)


def run_robot(scenario: Scenario, robot: int, world: str) -> None:
    """Run the program of one robot, counted from 1, until the world at the address `HOST:PORT` ends the run.

    Raises InputError for a robot that is not there or a governor that robots do not run themselves, PbrgError when no
    world answers, it has another scenario, or it is gone.
    """
    from pbrg_mj.transport.address import Address
    from pbrg_mj.transport.child import robot_process

    robot_process(scenario.yaml, robot, Address.of(world)).run()


def simulate(
    scenario: Scenario | str | Path,
    governor: Governor | RobotProgram | None = None,
    *,
    certificate: Certificate | None = None,
    estimator: Estimator | None = None,
    noise_model: NoiseModel | None = None,
    reference_solver: CentralizedSolver | None = None,
) -> Iterator[TickRecord]:
    """Return an iterator over the run's ticks, one record each, from t = 0 to t = duration. No log is written.

    Arguments and errors are those of `run`.
    """
    objects = Objects(governor, certificate, estimator, noise_model, reference_solver)
    scenario = with_objects(as_scenario(scenario), objects)
    _warn(scenario, governor)
    return Simulation.build(scenario.settings, objects).records()


def serve(scenario: Scenario | str | Path, port: int = 8765) -> LiveServer:
    """Return a live server for Foxglove on this machine, a context manager to hand to `run` among those who watch.

    It has its `address`; port 0 takes any free one. Raises InputError when the port is taken.
    """
    from pbrg_mj.log.live import LiveServer

    return LiveServer(as_scenario(scenario).settings, port)


def with_objects(scenario: Scenario, objects: Objects) -> Scenario:
    """Return the scenario with the classes of objects as the names of its parts, `object:` before them.

    Raises InputError for an object that lacks a method of its kind.
    """
    overrides = object_overrides(objects)
    return scenario.override(overrides) if overrides else scenario


def _governed_apart(simulation: Simulation, robots: RobotProcesses) -> Simulation:
    """Return the simulation with those robots, once all have come: no log is begun, and Ctrl-C ends the waiting."""
    robots.wait_for_robots()
    return simulation.governed_by(robots)


def _warn(scenario: Scenario, governor: Governor | RobotProgram | None) -> None:
    """Warn of a certificate, keys of other governors and settings of the network that do nothing with this one."""
    one = scenario.settings
    for line in certificate_warnings(one) + governor_warnings(one) + network_warnings(one, governor):
        LOG.warning("%s: %s", scenario.name, line)


def _record(
    simulation: Simulation,
    scenario: Scenario,
    path: Path,
    force: bool,
    watch: Iterable[Sink],
    profile: Profile | None,
    processes: bool,
) -> None:
    """Simulate into a log, which is closed and whole so far when this raises Interrupted."""
    kind = {"centralized": simulation.centralized, "processes": processes}
    writer = LogWriter(path, scenario.loaded, simulation.model_xml, force=force, **kind)
    with interruptible() as came, writer as write:
        sinks = (profile.timed("log", write) if profile else write, *watch, *([profile] if profile else []))
        for record in simulation.records():
            for sink in sinks:
                sink(record)
            if number := came():
                raise Interrupted(f"the log so far: {path}", number)
