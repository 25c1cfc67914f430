"""No reference, however far, loosens a constraint: the problem, the penalty, the closed loop."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.distributed.from_scenario import multiplier_cap
from pbrg_mj.governor.distributed.penalty import LEAST_SLACK, exact_multiplier_cap
from pbrg_mj.governor.problem.near_reference import near_references
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.problems import FORMATION, START, graph, problem

INADMISSIBLE = "paper/simulation_inadmissible"
LINE = np.array([1.0, 1.0]) / np.sqrt(2.0), 3.0 / np.sqrt(2.0)


def least_margin(seconds, *overrides):
    """The least distance of any robot from the paper's line, in the ideal plant, where places are known exactly."""
    loaded = load_scenario(INADMISSIBLE, (f"timing.duration={seconds}", "reference.solver=none", *overrides))
    normal, offset = LINE
    ticks = Simulation.build(loaded.scenario).control_ticks()
    return min(offset - float((tick.hand_world @ normal).max()) for tick in ticks)


@pytest.mark.parametrize("far", [[20.0, 30.0], [7e5, 1e6], [-7e5, 1e6], [1e4, 1.0]])
def test_the_distributed_governor_keeps_the_line_however_far_the_reference(far):
    assert least_margin(40, f"operator.reference={far}") > 0.05


@pytest.mark.parametrize("far", [[20.0, 30.0], [7e5, 1e6], [1e6, -0.9e6]])
def test_so_does_the_centralized_optimum(far):
    assert least_margin(20, f"operator.reference={far}", "governor.kind=centralized") > 0.0


@pytest.mark.parametrize("kind", ["centralized", "certified"])
@pytest.mark.parametrize(("leaders", "far"), [("[4,5]", [7e5, 7e5]), ("[1,2,3,4,5]", [20.0, 30.0])])
def test_so_do_those_that_apply_the_optimum_or_what_is_verified_with_several_leaders(kind, leaders, far):
    """The paper's flow does not: docs/theory.md says by how much it crosses on its way to the optimum."""
    how = (f"operator.reference={far}", f"team.leaders={leaders}", f"governor.kind={kind}")
    assert least_margin(12, *how) > -1e-6


@pytest.mark.parametrize(
    "how",
    [
        ("governor.backend=numpy",),
        ("network.delay_rounds=30",),
        ("network.exchange=scattering", "network.delay_rounds=30"),
    ],
)
def test_so_do_plain_numpy_and_late_messages(how):
    seconds = 3 if "numpy" in how[0] else 20
    near = least_margin(seconds, "operator.reference=[7e5, 1e6]", *how)
    assert near > 0.0
    if "numpy" in how[0]:
        assert near == pytest.approx(least_margin(seconds, "operator.reference=[7e5, 1e6]"), abs=1e-9)


def test_leaders_take_r_where_it_is_near_and_the_rim_of_their_disc_where_it_is_not():
    rng = np.random.default_rng(0)
    p = rng.normal(size=(7, 2))
    for size in (0.1, 3.0, 20.0, 1e6):
        r = size * rng.normal(size=2)
        near = near_references(p, r, 5.0)
        for own, taken in zip(p, near, strict=True):
            if np.linalg.norm(r - own) <= 5.0:
                assert taken.tolist() == r.tolist()  # to the bit
            else:
                assert np.linalg.norm(taken - own) == pytest.approx(5.0)
                assert np.cross(np.append(taken - own, 0.0), np.append(r - own, 0.0))[2] == pytest.approx(
                    0, abs=1e-6 * size
                )


def test_several_leaders_and_both_solvers_agree_on_the_optimum_of_a_far_reference():
    """Against the problem written out, each leader with an r_i of its own; the cost included."""
    import cvxpy as cp

    rng = np.random.default_rng(1)
    for reach in (np.inf, 5.0, 1.0):
        leaders = graph(leaders=(0, 2, 4))
        far = dataclasses.replace(
            problem([(4, [1, 1], 3.0)], 0.5 * rng.normal(size=(5, 2)), [9.0, 14.0], leaders), reference_range=reach
        )
        m = cp.Variable(2)
        y = cp.hstack([*(m - own for own in far.p), far.xi.reshape(-1)])
        g = [far.rows.a[4, k] * cp.norm(y) + far.rows.C[4, k] @ m <= far.rows.d[4, k] for k in range(5)]
        cost = sum(cp.sum_squares(far.near_references[i] - m) for i in (0, 2, 4))
        cp.Problem(cp.Minimize(cost), g).solve(solver=cp.CLARABEL)
        for solver in (ClarabelSolver(), CvxpySolver()):
            found = solver.solve(far)
            np.testing.assert_allclose(found.m, m.value, atol=5e-4)
            assert found.cost == pytest.approx(float(cost.value), rel=1e-5)


def planted(rng, n, slack):
    """One half-space of relative slack `slack`, an m on its border, and the r at distance 5 whose optimum it is."""
    s = float(rng.uniform(0.1, 3.0))
    D = s * np.sqrt((n - 1) / n) / (1.0 - slack) if slack < 1.0 else float(rng.uniform(0.1, 3.0))
    s = 0.0 if slack == 1.0 else s
    spread = np.sqrt(n * D**2 - (n - 1) * s**2)
    shortest, longest = (n * D - spread) / (n - 1), (n * D + spread) / (n - 1)
    radius = float(rng.choice([shortest, longest, rng.uniform(shortest, longest)]))
    x = D - radius
    w = np.array([x, np.sqrt(max((radius**2 - s**2) / n - x**2, 0.0))])
    gradient = n * w / radius + [1.0, 0.0]
    xi = np.zeros((n, 2))
    xi[0, 0], xi[1, 0] = s / np.sqrt(2.0), -s / np.sqrt(2.0)
    r = w + 5.0 * gradient / np.linalg.norm(gradient)
    team = graph([(k, k + 1) for k in range(n - 1)], (0,), n)
    return problem([(n - 1, [1.0, 0.0], D)], np.zeros((n, 2)), r, team, xi, np.zeros((n, 2))), w, gradient


@pytest.mark.parametrize("n", [2, 3, 5, 20])
def test_the_cap_is_never_in_the_way_of_one_half_space_with_five_per_cent_of_slack(n):
    """Planted optima: the solver finds them, multipliers below the cap; opposite to the line, at 5 %, just there."""
    rng, cap, largest = np.random.default_rng(n), exact_multiplier_cap(n, 1.0, 5.0), 0.0
    for slack in (LEAST_SLACK, 0.2, 0.6, 1.0):
        for _ in range(30):
            static, w, gradient = planted(rng, n, slack)
            needed = 10.0 / np.linalg.norm(gradient)
            largest = max(largest, needed)
            assert needed <= cap * (1 + 1e-9)
            found = ClarabelSolver().solve(static)
            np.testing.assert_allclose(found.m, w, atol=2e-3)
            assert found.multipliers.sum() == pytest.approx(needed, rel=2e-2)
    assert largest == pytest.approx(cap, rel=1e-6)  # and no smaller cap would do


def test_the_cap_comes_from_the_team_unless_it_is_given():
    def cap(*overrides):
        return multiplier_cap(load_scenario(INADMISSIBLE, overrides).scenario)

    assert cap() == pytest.approx(20.40, abs=0.01)
    assert cap("team.leaders=[4,5]") == pytest.approx(2 * cap())
    assert cap("governor.reference_range=2.5") == pytest.approx(0.5 * cap())
    assert cap("governor.multiplier_cap=0.3") == 0.3
    assert cap("governor.multiplier_cap=null") == np.inf


def test_a_far_reference_is_the_near_one_on_its_way():
    static = problem([(4, [1, 1], 3.0)], 0.3 * (START - FORMATION), [3e5, 4e5])
    own = static.p[4]
    rim = own + 5.0 * (static.reference - own) / np.linalg.norm(static.reference - own)
    far = ClarabelSolver().solve(dataclasses.replace(static, reference_range=5.0))
    near = ClarabelSolver().solve(dataclasses.replace(static, reference=rim))
    np.testing.assert_allclose(far.m, near.m, atol=1e-9)
    np.testing.assert_allclose(far.multipliers, near.multipliers, atol=1e-6)
