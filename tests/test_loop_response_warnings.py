"""Teams that follow references faster than the paper's flow finds them: told before the run, and what they do."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.stability.response import response_ratio
from pbrg_mj.loop.response_warnings import response_warnings, scenario_ratio
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.problems import graph

NORMAL, OFFSET = np.array([1.0, 1.0]) / np.sqrt(2.0), 3.0 / np.sqrt(2.0)


def paper(leaders, *overrides):
    changes = (f"team.leaders={leaders}", "reference.solver=none", "timing.duration=16", *overrides)
    return load_scenario("paper/simulation_inadmissible", changes).scenario


def least_margin(scenario):
    return min(OFFSET - float((tick.hand_world @ NORMAL).max()) for tick in Simulation.build(scenario).control_ticks())


@pytest.mark.parametrize(("leaders", "number"), [("[4,5]", 2), ("[3,4,5]", 3)])
@pytest.mark.parametrize("far", ["[20.0,30.0]", "[7e5,1e6]"])
def test_several_leaders_cross_as_is_told_and_with_alpha_r_over_their_square_they_do_not(leaders, number, far):
    fast = paper(leaders, f"operator.reference={far}")
    (line,) = response_warnings(fast)
    assert f"as fast as the flow of {number} leaders finds them (paper: up to 1.4)" in line
    assert least_margin(fast) < -0.5
    slow = paper(leaders, f"operator.reference={far}", f"control.alpha_r={1 / number**2}")
    assert response_warnings(slow) == []
    assert least_margin(slow) > 0.5


def test_the_papers_runs_and_other_governors_raise_no_doubt():
    for name, ratio in (("paper/simulation_near", 0.71), ("paper/experiment_near", 1.41)):
        assert response_warnings(pbrg.load(name).settings) == []
        assert scenario_ratio(pbrg.load(name).settings) == pytest.approx(ratio, abs=0.005)
    assert response_warnings(paper("[1,2,3,4,5]", "governor.kind=certified")) == []
    (line,) = pbrg.load("team/two_leaders").warnings()
    assert "14 times" in line


def test_the_ratio_by_hand_and_against_the_flow_simulated():
    """Two robots, one leads: alpha_r is so large that the team's rate is that of the follower; no rows in sight."""
    team, alpha = graph([(0, 1)], (0,), 2), 1.0
    none = np.zeros(2)
    L, D = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.diag([1.0, 0.0])
    ratio = response_ratio(team, 1e6, alpha, none)
    flow = np.block([[-L - 2 * alpha * D, L], [-L, 0 * L]])
    z = np.array([1.0, -1.0, 0.5, -0.5])  # zeta has no mean
    step, seconds = 1e-3, 40.0
    sizes = []
    for _ in range(int(seconds / step)):
        z = z + step * flow @ z
        sizes.append(np.linalg.norm(z))
    rate = np.log(sizes[len(sizes) // 2] / sizes[-1]) / (seconds / 2)
    assert ratio == pytest.approx(1.0 / rate, rel=0.05)
    assert response_ratio(team, 0.0, alpha, none) == pytest.approx(0.0, abs=1e-9)
    assert response_ratio(team, 1.0, 1e-3, none) > 50 * response_ratio(team, 1.0, 1.0, none)
