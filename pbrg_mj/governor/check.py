"""Whether a governor of one's own keeps the protocol: made problems, and what every answer to them must satisfy."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.check_messages import reactions_without_messages
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import RobotFacts, RobotProgram
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.plug_in_program import plug_in_program
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Governor, Problem, Solution
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.plugin_calls import plug_in_errors
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network

TICKS = 5  # of each problem
SLOTS = 3  # half-spaces of a robot
GOVERNOR_CHECKS = {
    "answers": "init and step answer every problem: shapes, finite numbers, a known status, bytes and counts >= 0",
    "writes": "init and step leave problem and memory as they were given",
    "repeats": "the same problem and memory give the same answer, bit for bit",
}
ROBOT_PROGRAM_CHECKS = {
    "answers": "programs answer every problem: bytes to neighbours, a finite m, a known status",
    "writes": "programs leave data and memory as they were given",
    "repeats": "the same data, messages and memory give the same answer, bit for bit",
    "alone": "no robot knows of another's data while no message arrives",
}


class GovernorCheck(NamedTuple):
    """One thing that a governor must do."""

    what: str
    failures: tuple[str, ...]  # what it does instead, and on which problem; empty: it does as it must

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return not self.failures


@dataclasses.dataclass(frozen=True)
class GovernorReport:
    """What `check_governor` found."""

    name: str
    checks: tuple[GovernorCheck, ...]

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    def __str__(self) -> str:
        """Return a line for each check, and the failures below theirs."""
        lines = [f"{self.name}: {'keeps' if self.passed else 'breaks'} the protocol of governors"]
        for check in self.checks:
            lines.append(f"  {'ok    ' if check.passed else 'FAILED'}  {check.what}")
            lines += [f"            {failure}" for failure in check.failures]
        return "\n".join(lines)


def check_governor(
    build: Callable[..., Any] | Governor | RobotProgram, scenario: Scenario, options: Mapping[str, Any] | None = None
) -> GovernorReport:
    """Test a governor on made problems of a scenario's team and return the report.

    `build` is a build function, as an entry point names it, or a governor itself; that of a robot program has a first
    parameter called `facts`. A robot program's messages all arrive, but for one check, in which none does.

    Raises InputError for options that do not fit the governor's own model, PlugInError whose text is the report when a
    check fails or the governor cannot be built.
    """
    report = governor_report(build, scenario, options)
    if not report.passed:
        raise PlugInError(str(report))
    return report


def governor_report(
    build: Callable[..., Any] | Governor | RobotProgram, scenario: Scenario, options: Mapping[str, Any] | None = None
) -> GovernorReport:
    """Return the report of `check_governor`, also where a check fails.

    Raises InputError for options that do not fit, PlugInError when the governor cannot be built.
    """
    made, program = _maker(build, scenario, options or {})
    name = made().name  # what keeps it from being built is no check
    whats = ROBOT_PROGRAM_CHECKS if program else GOVERNOR_CHECKS
    failures: dict[str, list[str]] = {key: [] for key in whats}
    for title, problems in _problem_sequences(scenario):
        try:
            _follow(title, made, problems, failures)
            if program:
                failures["alone"] += reactions_without_messages(title, made, problems)
        except PlugInError as error:
            failures["answers"].append(f"{title}: {error}")
    return GovernorReport(name, tuple(GovernorCheck(whats[key], tuple(found)) for key, found in failures.items()))


def _maker(build: Any, scenario: Scenario, options: Mapping[str, Any]) -> tuple[Callable[[], PlugInGovernor], bool]:
    """Return what makes a governor, given itself or by its build function, anew, and whether it is a robot program."""
    given = not callable(build)
    name = type(build).__name__ if given else getattr(build, "__name__", type(build).__name__)

    def make_program() -> PlugInGovernor:
        def make(facts: RobotFacts) -> Any:
            return build if given else plugins.make(plugins.ROBOT_PROGRAM, name, build, facts, options)

        return PlugInGovernor(NetworkedGovernor.of(scenario, plug_in_program(scenario, name, make)), name)

    def make_governor() -> PlugInGovernor:
        building = (lambda scenario: copy.deepcopy(build)) if given else build
        part = plugins.make(plugins.GOVERNOR, name, building, scenario, options, network=network(scenario))
        return PlugInGovernor(part, name, scenario.timing.plug_in_limit)

    program = not plugins.is_centralized(name, build) if given else _first_parameter(build) == "facts"
    return (make_program if program else make_governor), program


def _first_parameter(build: Any) -> str:
    return next(iter(plugins.parameters(build)), "")


def _follow(
    title: str, made: Callable[[], PlugInGovernor], problems: list[Problem], failures: dict[str, list[str]]
) -> None:
    """Step two governors through problems side by side and note what they do wrong, up to the first thing."""
    one, other = made(), made()
    memory, twin = None, None
    for tick, problem in enumerate(problems):
        at, kept = f"{title}, tick {tick}", copy.deepcopy(problem)
        if tick == 0:
            memory, twin = _init(one, problem), _init(other, copy.deepcopy(problem))
            if not same(problem, kept):
                failures["writes"].append(f"{at}: init wrote into the problem")
        with plug_in_errors("governor", one.name, "a copy of its memory"):
            before = copy.deepcopy(memory)
        found, after = _step(one, problem, memory)
        given = {"problem": (problem, kept), "memory": (memory, before)}
        wrote = [what for what, (now, then) in given.items() if not same(now, then)]
        failures["writes"] += [f"{at}: step wrote into the {what}" for what in wrote]
        again, twin = _step(other, kept, twin)
        if not same(found, again):
            failures["repeats"].append(f"{at}: two governors built alike answer differently")
        elif not wrote and not same(found, _step(one, problem, before)[0]):
            failures["repeats"].append(f"{at}: a second step from the same memory answers differently")
        memory = after
        if any(failures.values()):
            return


def _init(governor: PlugInGovernor, problem: Problem) -> Any:
    """Return the first memory; the problem may be written into, to see whether it is."""
    with plug_in_errors("governor", governor.name, "init", governor.limit):
        return governor.inner.init(problem)


def _step(governor: PlugInGovernor, problem: Problem, memory: Any) -> tuple[Solution, Any]:
    """Return the checked answer; the problem may be written into, to see whether it is."""
    unwritten = copy.deepcopy(problem)
    with plug_in_errors("governor", governor.name, "step", governor.limit):
        answer = governor.inner.step(problem, memory)
    return governor.checked(unwritten, answer)


def _problem_sequences(scenario: Scenario) -> Iterator[tuple[str, list[Problem]]]:
    """Yield problems in a row, under a title: without rows, with a wall ahead, with nothing admissible, and random."""
    graph, formation = network(scenario), np.array(scenario.team.formation, dtype=float)
    n, start = graph.robots, np.array(scenario.team.start, dtype=float) - formation
    rng = np.random.default_rng(1)

    def course(half_spaces: HalfSpaces, spread: float, reference: np.ndarray) -> list[Problem]:
        rows = ball_rows(half_spaces, formation)
        return [
            Problem(
                network=graph,
                p=start + spread * rng.normal(size=(n, 2)),
                xi=spread * rng.normal(size=(n, 2)),
                rows=rows,
                reference=reference,
                half_spaces=half_spaces,
                heading=np.zeros(n),
            )
            for _ in range(TICKS)
        ]

    nothing = HalfSpaces.empty(n, SLOTS)
    yield "no half-spaces", course(nothing, 0.0, np.array([1.0, 2.0]))
    reach = float(np.abs(start + formation).max()) + 1.0
    for title, offset in (("a wall ahead", 10.0 * reach), ("no admissible reference", -10.0 * reach)):
        wall = HalfSpaces.empty(n, SLOTS)
        wall.G[0, 0], wall.h[0, 0], wall.active[0, 0], wall.binds[0, 0] = (0.6, 0.8), offset, True, True
        yield title, course(wall, 0.01, np.array([20.0 * reach, 0.0]))
    turn = rng.uniform(0, 2 * np.pi, (n, SLOTS))
    active = rng.random((n, SLOTS)) < 0.6
    G = np.stack([np.cos(turn), np.sin(turn)], axis=-1) * active[..., None]
    binds = np.repeat(active[..., None], n, axis=2)
    seen = HalfSpaces(G, rng.uniform(1.0, 3.0, (n, SLOTS)) * reach * active, active, binds)
    yield "walls around", course(seen, 0.1, reach * rng.normal(size=2))


def same(one: Any, other: Any) -> bool:
    """Return whether two values are alike to the bit, arrays and what holds them included."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, Mapping):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.random.Generator):
        return same(one.bit_generator.state, other.bit_generator.state)
    if isinstance(one, float):
        return one == other or (one != one and other != other)
    if dataclasses.is_dataclass(one):  # by its fields: what it caches besides is no part of it
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in dataclasses.fields(one))
    if hasattr(one, "__dict__") and not callable(one):
        return same(vars(one), vars(other))
    return bool(one == other)
