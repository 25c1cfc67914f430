"""The certified layer against what it promises: no loss, delay or optimizer makes it break its own certificate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from pbrg_mj.governor.certified.at_once import LayerGovernor
from pbrg_mj.governor.messaging.carrier import CarriedGovernor
from pbrg_mj.governor.registry import governor
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario


def layered(name: str, *overrides: str) -> Scenario:
    return load_scenario(name, ["governor.kind=certified", "reference.solver=none", *overrides]).scenario


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("obstacles/corner", ["governor.optimizer=nids", "governor.rounds=4"]),
        ("obstacles/corner", ["governor.optimizer=scalar", "governor.certificate=directional_ball"]),
        ("team/two_leaders", ["governor.optimizer=admm", "governor.rounds=6"]),
        ("paper/simulation_inadmissible", ["governor.optimizer=paper_flow", "governor.certificate=ball"]),
    ],
)
def test_the_layer_at_once_is_the_robots_program(name: str, keys: list[str]) -> None:
    """Bit for bit, but for the paper's flow, whose compiled rounds round otherwise; byte for byte."""
    scenario = layered(name, *keys, "timing.duration=0.6")
    at_once = governor(scenario)
    assert isinstance(at_once, LayerGovernor)
    carried = CarriedGovernor(at_once.layer, scenario.governor.rounds)
    leaders, exact = np.array(scenario.team.leaders) - 1, scenario.governor.optimizer != "paper_flow"
    ours = theirs = None
    for tick in Simulation.build(scenario).control_ticks():
        ours = at_once.init(tick.problem) if ours is None else ours
        theirs = carried.init(tick.problem) if theirs is None else theirs
        one, ours = at_once.step(tick.problem, ours)
        other, theirs = carried.step(tick.problem, theirs)
        np.testing.assert_allclose(one.m[leaders], other.m[leaders], rtol=0.0, atol=0.0 if exact else 1e-9)
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert one.status == other.status
