"""Robot numbers wherever a scenario has one: they exist, and stand in a list once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath
from pbrg_mj.scenario.schema import Scenario


def robot_numbers(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield numbers of robots that are not there, and robots listed twice."""
    n = scenario.robots
    yield from _listed(("team", "leaders"), scenario.team.leaders, n)
    robots = scenario.sensors.beams.robots
    if robots != "all":
        yield from _listed(("sensors", "beams", "robots"), robots, n)
    for k, swap in enumerate(scenario.sensors.camera.swaps):
        yield from _listed(("sensors", "camera", "swaps", k, "robots"), swap.robots, n)
    for path, robot in _single(scenario):
        yield from in_range(path, robot, n)


def in_range(path: KeyPath, robot: int, n: int) -> Iterator[Diagnostic]:
    """Yield a diagnostic if there is no robot of that number, counted from 1, among n."""
    if robot > n:
        yield Diagnostic(path, f"is robot {robot}; allowed: 1 to {n}, the number of robots in team.start")


def _single(scenario: Scenario) -> Iterator[tuple[KeyPath, int]]:
    """Yield the entries that concern one robot each."""
    happen = scenario.disturbances
    entries = {
        ("estimator", "given"): scenario.estimator.given,
        ("disturbances", "pushes"): happen.pushes,
        ("disturbances", "dead_motors"): happen.dead_motors,
        ("disturbances", "kidnappings"): happen.kidnappings,
        ("sensors", "camera", "occlusions"): scenario.sensors.camera.occlusions,
        ("network", "outages"): scenario.network.outages,
        ("network", "pre_stabiliser", "outages"): scenario.network.pre_stabiliser.outages,
    }
    for path, several in entries.items():
        for k, entry in enumerate(several):
            yield (*path, k, "robot"), entry.robot
    for k, link in enumerate(scenario.network.links):
        for end, robot in enumerate(link.robots):
            yield ("network", "links", k, "robots", end), robot


def _listed(path: KeyPath, robots: Sequence[int], n: int) -> Iterator[Diagnostic]:
    seen: set[int] = set()
    for k, robot in enumerate(robots):
        yield from in_range((*path, k), robot, n)
        if robot in seen:
            yield Diagnostic((*path, k), f"is {robot}, which is in the list twice; allowed: each robot once")
        seen.add(robot)
