"""Velocity filters: each against its definition, an independent solver and its theorem."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.velocity_filter.barrier import BarrierFilter
from pbrg_mj.governor.velocity_filter.potential_field import PotentialField
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network_of_edges
from tests.filtering import driven_by


def problem_of(spaces: HalfSpaces) -> Problem:
    n = len(spaces.h)
    team = network_of_edges([(i, i + 1) for i in range(n - 1)], np.eye(n)[0])
    rows = Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))
    return Problem(team, np.zeros((n, 2)), np.zeros((n, 2)), rows, np.zeros(2), spaces)


def random_spaces(rng: np.random.Generator, n: int, slots: int, q: np.ndarray, nearest: float) -> HalfSpaces:
    """Return half-spaces that hand points q keep a distance from `nearest` on to; some bind their owner."""
    turn = rng.uniform(0, 2 * np.pi, (n, slots))
    G = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    h = np.einsum("ikx,ix->ik", G, q) + rng.uniform(nearest, 1.0, (n, slots))
    active = rng.random((n, slots)) < 0.8
    return HalfSpaces(G, h, active, active[:, :, None] & (rng.random((n, slots, n)) < 0.8))


def own_rows(spaces: HalfSpaces, j: int) -> np.ndarray:
    return np.flatnonzero(spaces.active[j] & spaces.binds[j, :, j])


def test_the_barrier_filter_is_the_quadratic_program_of_an_independent_solver() -> None:
    import cvxpy

    rng, n, gain, margin = np.random.default_rng(41), 6, 1.7, 0.02
    changed = 0
    for _ in range(12):
        q, velocity = rng.normal(size=(n, 2)), 2 * rng.normal(size=(n, 2))
        spaces = random_spaces(rng, n, 4, q, nearest=margin)
        driven = driven_by(BarrierFilter(gain, margin), problem_of(spaces), q, velocity)
        for j in range(n):
            rows, u = own_rows(spaces, j), cvxpy.Variable(2)
            G, h = spaces.G[j, rows], spaces.h[j, rows]
            limits = [G @ u <= gain * (h - margin - G @ q[j])] if len(rows) else []
            cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(u - velocity[j])), limits).solve(solver="CLARABEL")
            np.testing.assert_allclose(driven[j], u.value, atol=1e-5)
            changed += not np.array_equal(driven[j], velocity[j])
    assert changed > 20


def test_a_robot_beyond_half_spaces_that_contradict_each_other_violates_the_worst_least() -> None:
    spaces = HalfSpaces.empty(2, 2)
    spaces.G[0], spaces.h[0], spaces.active[0], spaces.binds[0] = [[1.0, 0.0], [-1.0, 0.0]], -0.1, True, True
    velocity = np.array([[0.7, 0.3], [0.4, 0.0]])
    driven = driven_by(BarrierFilter(1.0, 0.0), problem_of(spaces), np.zeros((2, 2)), velocity)
    np.testing.assert_allclose(driven, [[0.0, 0.3], [0.4, 0.0]], atol=1e-9)  # and no other robot's half-space counts


@pytest.mark.parametrize("gain", [0.5, 10.0, 100.0])
def test_behind_a_barrier_nobody_who_knows_it_crosses(gain: float) -> None:
    """At the largest gain, 1 / tick, too; the distance falls no faster than the rate says."""
    given = [{"robot": j, "normal": [1.0, 1.0], "offset": 1.5} for j in range(1, 6)]
    keys = {"governor.kind": "cbf", "governor.barrier_gain": gain, "estimator.given": given, "reference.solver": "none"}
    scenario = pbrg.load("paper/simulation_inadmissible", keys, duration=8.0).settings
    G, factor, before, nearest = np.array([1.0, 1.0]) / np.sqrt(2), 1.0 - gain * scenario.timing.tick, None, np.inf
    for tick in Simulation.build(scenario).control_ticks():
        distance = 1.5 / np.sqrt(2) - tick.hand_world @ G
        assert distance.min() >= -1e-12
        if before is not None:
            assert (distance >= factor * before - 1e-12).all()
        before, nearest = distance, min(nearest, distance.min())
    assert nearest < 0.05


def test_a_gain_that_crosses_within_a_tick_is_refused() -> None:
    with pytest.raises(
        pbrg.InputError, match=r"governor.barrier_gain: is 101 1/s, .* allowed: at most 1 / timing.tick"
    ):
        pbrg.load("paper/experiment_near", {"governor.kind": "cbf", "governor.barrier_gain": 101.0})


def test_the_repulsion_is_the_gradient_of_khatibs_potential() -> None:
    rng, n, eta, reach = np.random.default_rng(42), 8, 2e-3, 0.6
    q, velocity = rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
    spaces = random_spaces(rng, n, 3, q, nearest=0.15)
    field = PotentialField(eta, reach, 0.01)
    driven = driven_by(field, problem_of(spaces), q, velocity)

    def potential(j: int, at: np.ndarray) -> float:
        rows = own_rows(spaces, j)
        d = spaces.h[j, rows] - spaces.G[j, rows] @ at
        return float((eta / 2 * np.where(d < reach, 1 / d - 1 / reach, 0.0) ** 2).sum())

    for j in range(n):
        slope = [(potential(j, q[j] + 1e-6 * e) - potential(j, q[j] - 1e-6 * e)) / 2e-6 for e in np.eye(2)]
        np.testing.assert_allclose(driven[j], velocity[j] - slope, atol=1e-6)
    assert (driven != velocity).any(axis=1).sum() >= 4


def test_a_field_is_nowhere_steeper_than_a_tick_can_follow() -> None:
    eta, tick = 1e-3, 0.01
    spaces = HalfSpaces.empty(1, 1)
    spaces.G[0, 0], spaces.active[0], spaces.binds[0] = [1.0, 0.0], True, True
    field, x = PotentialField(eta, 0.5, tick), np.linspace(-0.6, 0.3, 2000)
    nothing = np.zeros((1, 2))
    u = [driven_by(field, problem_of(spaces), np.array([[at, 0.0]]), nothing)[0, 0] for at in x]
    slope = np.diff(u) / np.diff(x)
    assert 0.8 / tick < -slope.min() <= 1 / tick
    assert (slope <= 1e-9).all()
    assert u[0] == 0.0


@pytest.mark.slow
def test_a_barrier_of_the_leader_alone_lets_followers_cross_and_one_of_all_does_not() -> None:
    """What docs/rollout.md says of the paper's simulation."""
    crossings = []
    for robots in ((5,), (1, 2, 3, 4, 5)):
        given = [{"robot": j, "normal": [1.0, 1.0], "offset": 3.0} for j in robots]
        keys = {"governor.kind": "cbf", "estimator.given": given, "reference.solver": "none"}
        scenario = pbrg.load("paper/simulation_inadmissible", keys, duration=15.0).settings
        ticks = Simulation.build(scenario).control_ticks()
        crossings.append(max(float((tick.hand_world.sum(axis=1) - 3.0).max()) / np.sqrt(2) for tick in ticks))
    assert crossings[0] == pytest.approx(0.108, abs=0.002)
    assert crossings[1] <= 1e-12
