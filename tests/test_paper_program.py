"""The paper's algorithm as every robot's own program, messages carried as bytes: the compiled rounds, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.registry import governor
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

TREE = "graph={kind: edges, edges: [[1, 3], [3, 5], [3, 2], [5, 4]]}"  # degrees 1, 2 and 3
STAR = "graph={kind: edges, edges: [[1, 2], [1, 3], [1, 4], [1, 5]]}"
DIRECTIONS = "governor.certificate=directional_ball"
UNEVEN = ("network.delay_rounds=3", "network.links=[{robots: [1, 2], delay_rounds: 11}]")
CASES = {
    "ideal": ("paper/simulation_inadmissible",),
    "ideal, along directions": ("paper/simulation_inadmissible", DIRECTIONS),
    "physics, from the start positions": ("paper/experiment_inadmissible", "governor.initial=start"),
    "tree, two leaders": ("paper/simulation_inadmissible", TREE, "team.leaders=[2, 5]", "governor.rounds=3"),
    "star, capped": ("paper/simulation_inadmissible", STAR, "governor.multiplier_cap=0.05"),
    "proximal": ("paper/simulation_inadmissible", "governor.integration=proximal", "governor.rounds=1"),
    "speed limit": ("team/speed_limited",),
    "far reference": ("paper/simulation_near", "operator.reference=[1.0e5, 3.0]"),
    "late": ("paper/simulation_inadmissible", *UNEVEN),
    "out of order": ("paper/simulation_inadmissible", *UNEVEN, "network.jitter_rounds=9"),
    "a queue": ("paper/simulation_inadmissible", "network.jitter_rounds=9", "network.reordering=false"),
    "lost in runs": ("paper/simulation_inadmissible", "network.loss=0.4", "network.loss_burst=12", "seed=29"),
    "an outage, detected": (
        "paper/simulation_inadmissible",
        "network.outages=[{robot: 3, time: 0.2, duration: 0.35}]",
        "network.neighbour_timeout=0.05",
        "network.delay_rounds=2",
        "network.jitter_rounds=3",
    ),
}


FAST = ("ideal", "out of order")


@pytest.mark.parametrize(
    "case", [case if case in FAST else pytest.param(case, marks=pytest.mark.slow) for case in CASES]
)
def test_programs_of_robots_are_the_compiled_rounds_bit_for_bit(case):
    name, *keys = CASES[case]
    scenario = load_scenario(name, ["timing.duration=0.7", "reference.solver=none", *keys]).scenario
    programs = governor(scenario.model_copy(update={"governor": replaced(scenario.governor, backend="program")}))
    assert isinstance(programs, NetworkedGovernor)
    memory, statuses = None, set()
    for tick in Simulation.build(scenario).control_ticks():
        memory = programs.init(tick.problem) if memory is None else memory
        carried, memory = programs.step(tick.problem, memory)
        for field in ("m", "multipliers", "bytes_sent", "lost"):
            assert getattr(carried, field).tobytes() == getattr(tick.solution, field).tobytes(), (field, tick.index)
        assert (carried.status, carried.rounds) == (tick.solution.status, tick.solution.rounds)
        statuses.add(carried.status)
    assert carried.m.any()
    assert ("holding" in statuses) == (case == "an outage, detected")
    assert ("capped" in statuses) == (case == "star, capped")


def replaced(settings, **values):
    return settings.model_copy(update=values)


def test_a_run_on_programs_is_the_run_on_kernels():
    keys = ["timing.duration=1.0", "network.loss=0.3"]
    runs = [
        list(Simulation.build(load_scenario("paper/simulation_near", [*keys, backend]).scenario).records())
        for backend in ("governor.backend=compiled", "governor.backend=program")
    ]
    for ours, theirs in zip(*runs, strict=True):
        np.testing.assert_array_equal(ours.truth.hand_world, theirs.truth.hand_world)
        np.testing.assert_array_equal(ours.solution.bytes_sent, theirs.solution.bytes_sent)


def test_a_robot_whose_estimates_run_away_holds_the_last_within_bounds():
    keys = ["governor.step=0.5", "governor.backend=program", "timing.duration=1.0", "reference.solver=none"]
    ticks = list(Simulation.build(load_scenario("paper/simulation_near", keys).scenario).control_ticks())
    assert ticks[-1].solution.status == "diverged"
    assert np.isfinite(ticks[-1].solution.m).all()


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        (["governor.kind=centralized"], "is program with `kind: centralized`; allowed: with `kind: distributed` only"),
        (["network.exchange=scattering", "network.delay_rounds=1"], "with `network.exchange: plain` only"),
    ],
)
def test_what_programs_do_not_do_is_refused(keys, says):
    with pytest.raises(InputError, match=says):
        load_scenario("paper/simulation_near", ["governor.backend=program", *keys])
