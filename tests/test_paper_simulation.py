"""The paper's two simulations against its coupled ODE, integrated independently at a 20 times finer step."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.paper_ode import paper_solution

TIMES = np.array([1.0, 2.0, 5.0, 10.0, 20.0])
REFERENCES = {"paper/simulation_near": (1.0, 2.0), "paper/simulation_inadmissible": (2.0, 3.0)}


@pytest.fixture(scope="module")
def solutions():
    """(q, m) of the ODE at TIMES; the scenarios' round is 1 ms, the oracle's step 50 us."""
    at = np.rint(TIMES / 0.1).astype(int)
    return {name: [x[at] for x in paper_solution(r, 20.0, 5e-5)] for name, r in REFERENCES.items()}


def run(name, tick):
    """Return true hand points and references of a run at TIMES, with the scenario's rounds per tick."""
    scenario = load_scenario(name, ["timing.duration=20.0", f"timing.tick={tick}", "reference.solver=none"]).scenario
    at = set(np.rint(TIMES / tick).astype(int).tolist())
    records = [record for record in Simulation.build(scenario).records() if record.index in at]
    return [np.array([r.truth.hand_world for r in records]), np.array([r.solution.m for r in records])]


@pytest.mark.parametrize("name", REFERENCES)
def test_states_and_references_follow_the_papers_equations(name, solutions):
    q, m = run(name, 0.01)
    np.testing.assert_allclose(q, solutions[name][0], atol=1e-2, rtol=0)
    np.testing.assert_allclose(m, solutions[name][1], atol=1e-2, rtol=0)


@pytest.mark.parametrize("name", REFERENCES)
def test_the_error_falls_in_proportion_to_the_step(name, solutions):
    errors = [
        [np.abs(got - want).max() for got, want in zip(run(name, tick), solutions[name], strict=True)]
        for tick in (0.01, 0.005)
    ]
    coarse, fine = np.array(errors)
    np.testing.assert_allclose(coarse / fine, 2.0, atol=0.25)
