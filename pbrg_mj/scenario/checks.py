"""What must hold between the keys of a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from pbrg_mj.scenario.findings import Finding
from pbrg_mj.scenario.graph import edge_list, unreachable
from pbrg_mj.scenario.messages import messages
from pbrg_mj.scenario.numbering import in_range, robot_numbers
from pbrg_mj.scenario.physical import physical
from pbrg_mj.scenario.placement import placement
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.things import things
from pbrg_mj.scenario.words import Path, show

MOST_TICKS = 100_000_000  # eleven days at 10 ms, and a log of some 100 GB
MOST_STEPS = 10_000  # of physics in a tick
COARSEST_STEP = 0.005  # [s] at 10 ms the motors' static friction creeps by 7e-4 m/s


def check(scenario: Scenario) -> list[Finding]:
    """Return all that is wrong between keys that are right one by one; empty for a good scenario."""
    lengths = list(_lengths(scenario))
    # Where the lists of the team differ in length, places of robots mean nothing.
    rest = (robot_numbers, _given, _graph, _timing, _sensing, _operator, physical, things, messages)
    rest += () if lengths else (placement,)
    return lengths + [finding for part in rest for finding in part(scenario)]


def whole_multiple(period: float, step: float) -> int | None:
    """Return how many steps make the period, 1 or more; None if that is no whole number to 1e-9 relative.

    Both are > 0, in the same unit.
    """
    ratio = period / step
    if not math.isfinite(ratio):
        return None
    count = round(ratio)
    return count if abs(count * step - period) <= 1e-9 * period else None


def whole_number(period: float, step: float) -> int:
    """Return how many steps make the period. Raises ValueError if it is no whole number, 1 or more."""
    count = whole_multiple(period, step)
    if count is None:
        raise ValueError(f"{period} s is not a whole number of steps of {step} s")
    return count


def _lengths(scenario: Scenario) -> Iterator[Finding]:
    team, n = scenario.team, scenario.robots
    if len(team.formation) != n:
        yield Finding(
            ("team", "formation"), f"has {len(team.formation)} entries; allowed: {n}, one per robot in team.start"
        )
    if isinstance(team.heading_deg, tuple) and len(team.heading_deg) != n:
        yield Finding(
            ("team", "heading_deg"),
            f"has {len(team.heading_deg)} entries; allowed: one number, or {n}, one per robot in team.start",
        )


def _given(scenario: Scenario) -> Iterator[Finding]:
    for k, given in enumerate(scenario.estimator.given):
        if math.hypot(*given.normal) == 0:
            path = ("estimator", "given", k, "normal")
            yield Finding(path, f"is {show(given.normal)}; allowed: any direction, not zero")


def _graph(scenario: Scenario) -> Iterator[Finding]:
    graph, n = scenario.graph, scenario.robots
    path = ("graph", "edges")
    if graph.kind != "edges":
        if graph.edges:
            yield Finding(path, f"is given, but graph.kind is {graph.kind}; allowed: only with `kind: edges`")
        return
    if n > 1 and not graph.edges:
        yield Finding(path, "is empty; required with `kind: edges`: pairs of robots such as [1, 2]")
        return
    wrong = list(_edges(path, graph.edges, n))
    yield from wrong
    lonely = () if wrong else unreachable(edge_list(graph, n), n)
    if lonely:
        yield Finding(
            path, f"leave robot {lonely[0] + 1} out of reach of robot 1; allowed: a connected graph of {n} robots"
        )


def _edges(path: Path, edges: Sequence[tuple[int, int]], n: int) -> Iterator[Finding]:
    seen: set[tuple[int, int]] = set()
    for k, (i, j) in enumerate(edges):
        edge = (min(i, j), max(i, j))
        yield from in_range((*path, k), edge[1], n)
        if i == j:
            yield Finding((*path, k), f"is {show((i, j))}, robot {i} with itself; allowed: two different robots")
        elif edge in seen:
            yield Finding((*path, k), f"is {show((i, j))}, an edge given twice; allowed: each pair once")
        seen.add(edge)


def _timing(scenario: Scenario) -> Iterator[Finding]:
    timing = scenario.timing
    if scenario.plant == "physics":  # the ideal plant takes no physics steps
        if timing.physics_step > COARSEST_STEP:
            yield Finding(("timing", "physics_step"), f"is {timing.physics_step} s; allowed: at most {COARSEST_STEP} s")
        yield from _few(("timing", "tick"), timing.tick, "timing.physics_step", timing.physics_step, MOST_STEPS)
    yield from _few(("timing", "duration"), timing.duration, "timing.tick", timing.tick, MOST_TICKS)
    yield from _whole(("reference", "period"), scenario.reference.period, "timing.tick", timing.tick)


def _whole(path: Path, period: float, name: str, step: float) -> Iterator[Finding]:
    if whole_multiple(period, step) is None:
        yield Finding(path, f"is {period} s; allowed: a whole multiple of {name}, {step} s")


def _few(path: Path, period: float, name: str, step: float, most: int) -> Iterator[Finding]:
    if period / step > most * (1 + 1e-9):
        yield Finding(path, f"is {period:g} s; allowed: at most {most} times {name}, {step:g} s")
    else:
        yield from _whole(path, period, name, step)


def _sensing(scenario: Scenario) -> Iterator[Finding]:
    beams, estimator = scenario.sensors.beams, scenario.estimator
    if beams.range_min >= beams.range_max:
        yield Finding(
            ("sensors", "beams"),
            f"has range_min {beams.range_min} m; allowed: less than range_max, {beams.range_max} m",
        )
    if estimator.source == "given":
        return
    if scenario.plant == "ideal":
        yield Finding(("plant",), "is ideal, which has no beams; allowed: with `estimator.source: given` only")
    elif estimator.given:
        yield Finding(("estimator", "given"), "is given, but estimator.source is beams; allowed: with `source: given`")


def _operator(scenario: Scenario) -> Iterator[Finding]:
    operator = scenario.operator
    if (operator.reference is None) == (not operator.waypoints):
        both = "has both reference and waypoints" if operator.waypoints else "has neither reference nor waypoints"
        yield Finding(("operator",), f"{both}; allowed: one of them")
    times = [waypoint.time for waypoint in operator.waypoints]
    if times and times[0] != 0:
        yield Finding(("operator", "waypoints", 0, "time"), f"is {times[0]} s; allowed: 0, the first waypoint's time")
    for k, (before, after) in enumerate(pairwise(times), start=1):
        if after <= before:
            yield Finding(
                ("operator", "waypoints", k, "time"), f"is {after} s; allowed: later than the one before, {before} s"
            )
