"""The step kappa that a certificate allows against bisection on the certificate itself, and the nearest point."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pbrg_mj.governor.certificate.ball import BallAtState
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.nearest import nearest_admissible
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread, largest_kappa
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.rows import Rows, rho, row_values
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Control
from tests.problems import graph

N = 5
FORMATION = 0.5 * np.random.default_rng(41).normal(size=(N, 2))
MODEL = TeamModel.of(graph(), Control(alpha_r=1.3), 0.01)
GRID = PredictionGrid.of(MODEL)
GROWTH = 1.02
State = tuple[np.ndarray, np.ndarray, np.ndarray]  # p, xi, held


def random_half_spaces(rng: np.random.Generator, around: np.ndarray) -> HalfSpaces:
    spaces = HalfSpaces.empty(N, 2)
    for i in range(N):
        for k in range(int(rng.integers(0, 3))):
            angle = rng.uniform(0, 2 * np.pi)
            G = np.array([np.cos(angle), np.sin(angle)])
            spaces.G[i, k], spaces.h[i, k], spaces.active[i, k] = G, G @ around + rng.uniform(1.0, 6.0), True
            spaces.binds[i, k] = rng.random(N) < 0.7
    return spaces


def random_state(rng: np.random.Generator) -> State:
    p = rng.normal(size=2) + 0.2 * rng.normal(size=(N, 2))
    xi = 0.1 * rng.normal(size=(N, 2))
    return p, xi - xi.mean(axis=0), p.mean(axis=0) + 0.1 * rng.normal(size=2)


def ball_value(spaces: HalfSpaces, state: State, m: np.ndarray) -> float:
    p, xi, _ = state
    rows = ball_rows(spaces, FORMATION)
    return float(row_values(rows._replace(a=GROWTH * rows.a), m, p, xi).max(initial=-np.inf))


def directional_value(spaces: HalfSpaces, state: State, m: np.ndarray) -> float:
    p, xi, _ = state
    worst = -math.inf
    for i, k, j in np.argwhere(spaces.binds & spaces.active[:, :, None]):
        G = spaces.G[i, k]
        error = np.concatenate([(p - m) @ G, xi @ G])
        worst = max(worst, GROWTH * float(np.linalg.norm(error)) + G @ (m + FORMATION[j]) - spaces.h[i, k])
    return float(worst)


def predicted_value(spaces: HalfSpaces, state: State, m: np.ndarray) -> float:
    p, xi, held = state
    worst = -math.inf
    for i, k, j in np.argwhere(spaces.binds & spaces.active[:, :, None]):
        G = spaces.G[i, k]
        y, z = G @ held, G @ (m - held)
        error = np.concatenate([(p - held) @ G, xi @ G])
        E = GRID.E.reshape(N, -1, 2 * N)[j]
        reach = GRID.bound[j] * (np.linalg.norm(error) + np.sqrt(N) * abs(z))
        worst = max(worst, float((E @ error + GRID.s[j] * z + reach).max()) + y + G @ FORMATION[j] - spaces.h[i, k])
    return float(worst)


CERTIFICATES = {
    "ball": (BallAtState(FORMATION, GROWTH, 0.0, None), ball_value),
    "directional_ball": (DirectionalBall(FORMATION, GROWTH, 0.0), directional_value),
    "predictive": (PredictiveCertificate(GRID, FORMATION, 0.0), predicted_value),
}


def bisected(value: Callable[[np.ndarray], float], held: np.ndarray, candidate: np.ndarray) -> float:
    low, high = 0.0, 1.0
    if value(candidate) <= 0.0:
        return 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if value(held + middle * (candidate - held)) <= 0.0 else (low, middle)
    return low


@pytest.mark.parametrize("name", CERTIFICATES)
def test_the_share_is_what_bisection_finds_on_the_certificate_itself(name: str) -> None:
    certificate, value = CERTIFICATES[name]
    rng, partial, forbidden = np.random.default_rng(42), 0, 0
    for _ in range(100):
        state = random_state(rng)
        spaces, candidate = random_half_spaces(rng, state[2]), state[2] + 4.0 * rng.normal(size=2)
        kappa, admissible = largest_kappa(
            certificate.rows_at(spaces, *state), Spread.of(*state[:2]), state[2], candidate
        )
        at_held = value(spaces, state, state[2])
        if name == "predictive" and admissible and at_held > 1e-9:
            continue  # a row of a weak step response stops an advance and asks for no retreat
        assert admissible == (at_held <= 1e-9)
        if not admissible:
            forbidden += 1
            assert kappa == 0.0
            continue
        expected = bisected(lambda m, s=spaces, now=state: value(s, now, m), state[2], candidate)
        assert kappa == pytest.approx(expected, abs=1e-9)
        partial += 0.0 < kappa < 1.0
    assert partial > 25
    assert forbidden > 1


def test_the_ball_of_one_robot_and_of_inputs() -> None:
    """n = 1 makes the parabola a straight line; an input row has no direction."""
    rng = np.random.default_rng(43)
    for _ in range(200):
        a, C = float(rng.choice([1.0, 1.5])), rng.normal(size=2)
        C = C / np.linalg.norm(C) if rng.random() < 0.7 else np.zeros(2)
        p, held = rng.normal(size=(1, 2)), rng.normal(size=2)
        xi = np.zeros((1, 2))
        candidate = held + rng.normal(size=2) if rng.random() < 0.7 else held + 3.0 * C
        d = a * rho(held, p, xi) + C @ held + rng.uniform(0.0, 2.0)
        rows = Rows(np.array([[a]]), C[None, None], np.array([[d]]), np.ones((1, 1), dtype=bool))
        kappa, admissible = largest_kappa(rows, Spread.of(p, xi), held, candidate)
        assert admissible
        value = lambda m, rows=rows, p=p, xi=xi: float(row_values(rows, m, p, xi)[0, 0])  # noqa: E731
        assert kappa == pytest.approx(bisected(value, held, candidate), abs=1e-6)
        assert value(held + kappa * (candidate - held)) <= 1e-9


def test_one_row_stands_for_all_that_share_its_half_space() -> None:
    rng = np.random.default_rng(44)
    for _ in range(50):
        p, xi, held = random_state(rng)
        spaces = random_half_spaces(rng, held)
        ours = row_values(BallAtState(FORMATION, GROWTH, 0.0, None).rows_at(spaces, p, xi, held), held, p, xi)
        assert ours.max(initial=-np.inf) == pytest.approx(ball_value(spaces, (p, xi, held), held), abs=1e-12)


def test_holding_keeps_the_papers_row_at_every_later_tick() -> None:
    """Gamma Gamma rho + G.m <= c now makes rho + G.m <= c hold for ever though the sampled V may grow."""
    rng, m = np.random.default_rng(45), np.array([0.3, -2.0])
    model = TeamModel.of(graph(), Control(alpha_r=1.0), 0.2)  # a long tick, so that the growth shows
    assert model.growth > 1.01
    grown = 0
    for _ in range(100):
        p, xi = 0.01 * rng.normal(size=(N, 2)), rng.normal(size=(N, 2))
        xi -= xi.mean(axis=0)
        first = before = rho(m, p + m, xi)
        p = p + m
        for _ in range(100):
            p, xi = model.predicted(p, xi, m, 1)
            now = rho(m, p, xi)
            assert now <= model.growth * first * (1 + 1e-12)
            grown += now > before * (1 + 1e-9)
            before = now
    assert grown > 50


def test_the_nearest_admissible_point_is_the_cone_programs() -> None:
    import cvxpy as cp

    rng, outside = np.random.default_rng(47), 0
    for _ in range(40):
        p, xi, held = random_state(rng)
        spaces, target = random_half_spaces(rng, held), held + 5.0 * rng.normal(size=2)
        rows = BallAtState(FORMATION, GROWTH, 0.0, None).rows_at(spaces, p, xi, held)
        if rng.random() < 0.5:  # and a half-plane
            rows.a[0, 0], rows.active[0, 0], rows.C[0, 0] = 0.0, True, [0.6, 0.8]
            rows.d[0, 0] = float(rows.C[0, 0] @ held + 0.3)
        m, found = nearest_admissible(rows, Spread.of(p, xi), target)
        z = cp.Variable(2)
        radius = cp.norm(cp.hstack([np.sqrt(N) * (z - p.mean(axis=0)), np.sqrt(Spread.of(p, xi).square)]))
        active = zip(rows.a[rows.active], rows.C[rows.active], rows.d[rows.active], strict=True)
        problem = cp.Problem(cp.Minimize(cp.sum_squares(z - target)), [a * radius + C @ z <= d for a, C, d in active])
        problem.solve(solver=cp.CLARABEL)
        assert found == (problem.status == "optimal")
        if found:
            np.testing.assert_allclose(m, np.array(z.value), atol=1e-4)
            assert row_values(rows, m, p, xi).max(initial=-1.0) <= 2e-9
        else:
            outside += 1
    assert 0 < outside < 20
