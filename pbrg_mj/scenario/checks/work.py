"""A tick's work is bounded: keys that are possible one by one may together be more than anybody waits for."""

from __future__ import annotations

from collections.abc import Iterator

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema import Scenario, edge_list

MOST_NUMBERS = 10**9  # heard or weighed in a tick's rounds: about a second
MOST_ROBOT_STEPS = 10**5  # of physics in a tick, a step of one robot counting once: about a second
MOST_BEAMS = 15_000  # of all robots: MuJoCo puts a model together in a time that grows with its square; 10 s of these


def work(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield rounds that take longer than about a second a tick, and more beams than a model can be made of."""
    numbers = numbers_per_tick(scenario)
    if numbers > MOST_NUMBERS:
        governor, n = scenario.governor, scenario.robots
        yield Diagnostic(
            ("governor", "rounds"),
            f"is {governor.rounds}, by which {n} robots on this graph handle {numbers:.2g} numbers a tick; "
            f"allowed: at most {MOST_NUMBERS:.0e}, with fewer rounds, robots or links",
        )
    beams = len(scenario.beam_robots) * scenario.sensors.beams.all_rays
    if scenario.plant == "physics" and beams > MOST_BEAMS:
        yield Diagnostic(
            ("sensors", "beams"),
            f"has {beams} beams on {len(scenario.beam_robots)} robots; allowed: at most {MOST_BEAMS} in all",
        )


def physics_work(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield physics steps, each possible, that take all robots longer than about a second a tick."""
    steps = robot_steps_per_tick(scenario)
    if steps > MOST_ROBOT_STEPS * (1 + 1e-9):
        yield Diagnostic(
            ("timing", "physics_step"),
            f"is {scenario.timing.physics_step:g} s, by which {scenario.robots} robots take {steps:.2g} physics steps "
            f"a tick in all; allowed: at most {MOST_ROBOT_STEPS:.0e}, with longer steps, shorter ticks or fewer robots",
        )


def numbers_per_tick(scenario: Scenario) -> int:
    """Return how many numbers the rounds of a tick handle: 2 (4n + 2) in each message, and each robot's rows."""
    if scenario.governor.kind != "distributed":
        return 0
    n, messages = scenario.robots, 2 * len(edge_list(scenario.graph, scenario.robots))
    rows = n * scenario.estimator.half_spaces_per_robot
    return scenario.governor.rounds * (messages * 2 * (4 * n + 2) + n * rows)


def robot_steps_per_tick(scenario: Scenario) -> float:
    """Return how many physics steps all robots together take in a tick; none in the ideal plant."""
    if scenario.plant == "ideal":
        return 0.0
    return scenario.robots * scenario.timing.tick / scenario.timing.physics_step
