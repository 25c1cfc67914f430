"""Rows of g against what they promise: constraints that hold for ever while m is constant."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.governor.problem.ball import BallCertificate, ball_rows, input_rows
from pbrg_mj.governor.problem.rows import rho, row_values
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from tests.problems import FORMATION, GRAPHS, graph, half_spaces

ALPHA_R = 1.7


def test_ball_rows_are_eq_9b_for_every_half_space_and_every_robot_it_binds():
    rng = np.random.default_rng(0)
    spaces = half_spaces([(1, [1.0, 2.0], 3.0), (1, [0.0, -2.0], 1.0), (4, [1.0, 1.0], 3.0)])
    spaces.binds[1, 1] = [False, True, False, False, True]
    m, p, xi = rng.normal(size=2), rng.normal(size=(5, 2)), rng.normal(size=(5, 2))
    radius = np.sqrt(sum(np.sum((m - p[j]) ** 2) + np.sum(xi[j] ** 2) for j in range(5)))
    expected = [
        (i, k, j, radius + spaces.G[i, k] @ (m + FORMATION[j]) - spaces.h[i, k])
        for i, k in np.argwhere(spaces.active)
        for j in np.flatnonzero(spaces.binds[i, k])
    ]
    values = row_values(ball_rows(spaces, FORMATION), m, p, xi)
    assert np.isfinite(values).sum() == len(expected) == 12
    for i, k, j, value in expected:
        assert values[i, 5 * k + j] == pytest.approx(value, abs=1e-12)


def system(network, control):
    """The pre-stabilised team under m = 0 as one matrix on (p, xi), by probing with unit vectors."""
    columns = []
    for unit in np.eye(20):
        p, xi = unit[:10].reshape(5, 2), unit[10:].reshape(5, 2)
        u, rate = pre_stabilise(network, control, p, xi, np.zeros((5, 2)))
        columns.append(np.concatenate([u.reshape(-1), rate.reshape(-1)]))
    return np.array(columns).T


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("leak", [0.0, 0.3])
def test_v_never_grows_while_m_is_constant(name, leak):
    """dV/dt = y'(A + A')y / 2 <= 0 for every state: the ball is invariant, with the leak as well."""
    A = system(graph(GRAPHS[name]), Control(alpha_r=ALPHA_R, leak=leak))
    assert np.linalg.eigvalsh(A + A.T).max() <= 1e-12
    assert np.linalg.eigvals(A).real.max() < 1e-12


def test_leaders_that_disagree_let_the_ball_grow_by_a_quarter_alpha_r_of_their_squared_distances_at_most():
    """With several leaders d(rho(m)^2 / 2)/dt <= alpha_r / 4 sum_l ||m_l - m||^2, and some state reaches it."""
    rng, network, control, closest = np.random.default_rng(7), graph(leaders=(0, 2, 4)), Control(alpha_r=ALPHA_R), 0.0
    for trial in range(300):
        m, p, xi = rng.normal(size=2), rng.normal(size=(5, 2)), rng.normal(size=(5, 2))
        applied = m + rng.normal(size=(5, 2))
        if trial % 2:  # the state that grows most: L e = 0, and every leader half way to the m it applies
            applied, p = np.tile(applied[0], (5, 1)), np.tile(m + 0.5 * (applied[0] - m), (5, 1))
        u, rate = pre_stabilise(network, control, p, xi, applied)
        growth = np.sum((p - m) * u) + np.sum(xi * rate)
        bound = 0.25 * ALPHA_R * np.sum((applied - m)[[0, 2, 4]] ** 2)
        assert growth <= bound + 1e-12
        closest = max(closest, growth / bound)
    assert closest == pytest.approx(1.0)


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("leak", [0.0, 0.3])
def test_the_leak_keeps_the_sum_of_xi_and_the_formation(name, leak):
    rng = np.random.default_rng(3)
    network, control = graph(GRAPHS[name]), Control(alpha_r=ALPHA_R, leak=leak)
    p, xi = rng.normal(size=(5, 2)), rng.normal(size=(5, 2))
    _, rate = pre_stabilise(network, control, p, xi, np.zeros((5, 2)))
    np.testing.assert_allclose(rate.sum(axis=0), 0.0, atol=1e-12)
    xi -= xi.mean(axis=0)
    end = expm(400.0 * system(network, control)) @ np.concatenate([p.reshape(-1), xi.reshape(-1)])
    np.testing.assert_allclose(end, 0.0, atol=1e-6)  # p_j = m for all j, xi = 0


def test_the_leak_bounds_xi_behind_stuck_wheels():
    """Robots that do not move at all: without the leak xi grows for ever, with it xi tends to -p / leak."""
    network = graph()
    p = np.array([[0.3, 0.0], [0.0, 0.1], [-0.2, 0.0], [0.0, -0.1], [-0.1, 0.0]])
    for leak, grows in ((0.0, True), (0.5, False)):
        xi = np.zeros((5, 2))
        for _ in range(20_000):
            _, rate = pre_stabilise(network, Control(leak=leak), p, xi, p)
            xi = xi + 0.01 * rate
        assert (np.abs(xi).max() > 50) == grows
        if not grows:
            np.testing.assert_allclose(xi, -(p - p.mean(axis=0)) / leak, atol=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_one_input_row_keeps_u_in_the_whole_disc_for_ever(seed):
    """States on the row's border: the true u stays inside, and some state reaches the limit in any direction."""
    rng = np.random.default_rng(seed)
    network, limit = graph(leaders=(0, 4)), 0.8
    rows = input_rows(network, ALPHA_R, limit)
    assert rows.d.shape == (5, 1)
    A = system(network, Control(alpha_r=ALPHA_R))
    direction = rng.normal(size=2)
    direction /= np.linalg.norm(direction)
    for i in range(5):
        radius = rows.d[i, 0] / rows.a[i, 0]  # largest rho that robot i's row allows at m = 0
        state = rng.normal(size=20)
        state *= radius / np.linalg.norm(state)
        assert rho(np.zeros(2), state[:10].reshape(5, 2), state[10:].reshape(5, 2)) == pytest.approx(radius)
        for time in np.linspace(0.0, 6.0, 25):
            assert np.linalg.norm((A @ expm(time * A) @ state)[2 * i : 2 * i + 2]) <= limit + 1e-12
        asked = direction @ A[2 * i : 2 * i + 2]  # the row of F u_i with F the direction
        worst = asked / np.linalg.norm(asked) * radius  # the ball's point that asks most of it
        assert asked @ worst == pytest.approx(limit)


def test_the_certificate_stacks_half_spaces_and_inputs():
    spaces = half_spaces([(4, [1, 1], 3.0)])
    inputs = input_rows(graph(), 1.0, 0.5)
    both = BallCertificate(FORMATION, inputs).rows(spaces)
    alone = BallCertificate(FORMATION, None).rows(spaces)
    assert both.d.shape == (5, 3 * 5 + 1)
    np.testing.assert_array_equal(both.d[:, :15], alone.d)
    np.testing.assert_array_equal(both.a[:, 15:], inputs.a)
    assert both.active[:, 15:].all()


@pytest.mark.parametrize("kind", ["certified", "rollout", "centralized"])
def test_a_team_too_slow_for_a_prediction_is_the_scenario_s_fault(kind):
    slow = {"governor.kind": kind, "governor.certificate": "predictive", "control.alpha_r": 1e-9}
    with pytest.raises(InputError, match=r"control\.alpha_r: is 1e-09, with which the team does not settle"):
        next(pbrg.simulate(pbrg.load("paper/simulation_near", slow)))
