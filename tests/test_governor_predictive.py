"""Certificates of the predicted motion against brute force: every tick simulated, every claim searched for a lie."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.baselines import CentralizedGovernor
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall, interval
from pbrg_mj.governor.certificate.evaluate import rows_of_model, worst_rows
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.projection import least_violating, near_allowed, nearest_allowed, search_radius
from pbrg_mj.governor.certificate.speed import SpeedLimit, disc_facets, wheel_facets
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import pre_stabiliser_rates
from pbrg_mj.world.scene.robot import load_robot_model

GRAPHS = {
    "one": (1, [], [1]),
    "path of 3": (3, [(0, 1), (1, 2)], [0, 0, 1]),
    "ring of 5": (5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], [0, 0, 0, 0, 1]),
    "complete of 6, two leaders": (6, [(i, j) for i in range(6) for j in range(i + 1, 6)], [1, 0, 0, 1, 0, 0]),
}


def team_of(name: str) -> Network:
    robots, edges, leader = GRAPHS[name]
    assert len(leader) == robots
    return network_of_edges(edges, np.array(leader, dtype=float))


def model_of(team: Network, alpha_r: float = 2.5, leak: float = 0.0, tick: float = 0.01) -> TeamModel:
    return TeamModel.of(team, Control(alpha_r=alpha_r, leak=leak), tick)


def half_spaces_of(rng: np.random.Generator, n: int, slots: int, around: np.ndarray, reach: float) -> HalfSpaces:
    """Return random half-spaces that hold at `around` with some room."""
    spaces = HalfSpaces.empty(n, slots)
    for i in range(n):
        for k in range(slots):
            angle = rng.uniform(0, 2 * np.pi)
            G = np.array([np.cos(angle), np.sin(angle)])
            spaces.G[i, k], spaces.h[i, k], spaces.active[i, k] = G, G @ around + rng.uniform(0.2, reach), True
            spaces.binds[i, k] = rng.random(n) < 0.7
    return spaces


def crossing(spaces: HalfSpaces, q: np.ndarray) -> float:
    """Return by how much hand points q (n, 2) cross the worst half-space; negative: a margin."""
    values = spaces.G @ q.T - spaces.h[:, :, None]
    return float(np.where(spaces.binds, values, -np.inf).max(initial=-np.inf))


@pytest.mark.parametrize("name", GRAPHS)
def test_the_model_is_the_pre_stabiliser_stepped_as_the_ideal_plant_does(name: str) -> None:
    team, rng, control = team_of(name), np.random.default_rng(11), Control(alpha_r=1.7, leak=0.1)
    p, xi = rng.normal(size=(team.robots, 2)), rng.normal(size=(team.robots, 2))
    xi -= xi.mean(axis=0)
    m = rng.normal(size=2)
    model = model_of(team, 1.7, 0.1, 0.02)
    expected_p, expected_xi = p, xi
    for _ in range(50):
        u, rate = pre_stabiliser_rates(team, control, expected_p, expected_xi, np.tile(m, (team.robots, 1)))
        expected_p, expected_xi = expected_p + 0.02 * u, expected_xi + 0.02 * rate
    got_p, got_xi = model.predicted(p, xi, m, 50)
    np.testing.assert_allclose(got_p, expected_p, atol=1e-12)
    np.testing.assert_allclose(got_xi, expected_xi, atol=1e-12)
    velocity = model.rate @ np.vstack([got_p - m, got_xi])
    u, _ = pre_stabiliser_rates(team, control, got_p, got_xi, np.tile(m, (team.robots, 1)))
    np.testing.assert_allclose(velocity, u, atol=1e-12)


@pytest.mark.parametrize("name", GRAPHS)
def test_no_error_grows_by_more_than_the_factor(name: str) -> None:
    model = model_of(team_of(name), tick=0.02)
    power, largest = model.after(0), 1.0
    for _ in range(3000):
        power = power @ model.moving_part
        largest = max(largest, float(np.linalg.norm(power, 2)))
    assert largest <= model.growth * (1 + 1e-12)


@pytest.mark.parametrize("name", GRAPHS)
def test_the_grid_bounds_every_tick_and_all_that_follow(name: str) -> None:
    model, rng = model_of(team_of(name)), np.random.default_rng(12)
    grid, n = PredictionGrid.of(model, between=2e-3), model.robots  # coarse, so that the bound is at work
    points = grid.tick[:-1]
    assert len(points) < grid.horizon / 4 or n == 1
    for _ in range(5):
        error = rng.normal(size=2 * n)
        error[n:] -= error[n:].mean()
        bounded = (grid.E @ error).reshape(n, -1) + grid.bound * np.linalg.norm(error)
        rows = {(j, int(t)): bounded[j, k] for j in range(n) for k, t in enumerate(points)}
        tail = bounded[:, -1]
        x, worst = error.copy(), -np.inf
        for t in range(grid.horizon + 2000):
            after = points[min(np.searchsorted(points, t), len(points) - 1)]
            before = points[max(np.searchsorted(points, t, side="right") - 1, 0)]
            for j in range(n):
                limit = tail[j] if t > grid.horizon else max(rows[j, int(before)], rows[j, int(after)])
                worst = max(worst, x[j] - limit)
            x = model.step @ x
        assert worst <= 1e-12


@pytest.mark.parametrize("name", GRAPHS)
def test_every_reference_within_the_rows_keeps_every_predicted_tick(name: str) -> None:
    """And the rows are not idle: a centimetre beyond the interval's end some tick crosses, or nearly."""
    team, rng = team_of(name), np.random.default_rng(13)
    n, model = team.robots, model_of(team)
    formation = rng.normal(size=(n, 2))
    certificate = PredictiveCertificate(PredictionGrid.of(model), formation, 0.0)
    tight = 0
    for _ in range(25):
        p = rng.normal(size=2) + 0.3 * rng.normal(size=(n, 2))
        xi = 0.2 * rng.normal(size=(n, 2))
        xi -= xi.mean(axis=0)
        held = p.mean(axis=0)
        spaces = half_spaces_of(rng, n, 2, held, 3.0)
        for i in range(n):
            for k in range(2):  # so that holding is admissible: no nearer than the formation reaches
                spaces.h[i, k] += (formation @ spaces.G[i, k]).max() + 1.0
        rows = certificate.rows_at(spaces, p, xi, held)
        normals = rows.C[rows.active]
        offsets = rows.d[rows.active] - normals @ held
        found, x, y = nearest_allowed(*(10 * rng.normal(size=2)), normals, offsets, 0.0)
        assert found
        worst, (ahead_p, ahead_xi) = -np.inf, (p, xi)
        m = held + np.array([x, y])
        for _ in range(certificate.grid.horizon + 200):
            worst = max(worst, crossing(spaces, ahead_p + formation))
            ahead_p, ahead_xi = model.predicted(ahead_p, ahead_xi, m, 1)
        assert worst <= 1e-9
        at_once = HalfSpaces(*(array[None] for array in (spaces.G, spaces.h, spaces.active, spaces.binds)))
        _, _, found = worst_rows(at_once, (p[None], xi[None], m[None, None]), formation, rows_of_model(model))[0]
        assert found == pytest.approx(worst, abs=2e-3)
        tight += worst > -5e-3
    assert tight >= 10  # the nearest point to a far target lies on a row, and most rows are as good as exact


def test_holding_stays_admissible_for_ever_against_an_adversary_at_the_reference() -> None:
    """The ideal team under random references and a governor that applies what the rows allow: nobody crosses, ever."""
    team, rng = team_of("ring of 5"), np.random.default_rng(14)
    model, n = model_of(team, 1.0), 5
    formation = np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])
    certificate = PredictiveCertificate(PredictionGrid.of(model), formation, 0.0)
    spaces = half_spaces_of(rng, n, 1, np.zeros(2), 1.0)
    for i in range(n):
        spaces.h[i, 0] += (formation @ spaces.G[i, 0]).max() + 0.5
    p, xi = 0.2 * rng.normal(size=(n, 2)), np.zeros((n, 2))
    governor, held = CertifiedGovernor((), 2, np.inf), p.mean(axis=0)
    reference, worst = np.zeros(2), -np.inf
    for tick in range(6000):
        if tick % 1000 == 0:
            reference = 10.0 ** rng.uniform(-1, 6) * rng.normal(size=2)
        rows = certificate.rows_at(spaces, p, xi, held)
        solution, held = governor.step(Problem(team, p, xi, rows, reference), held)
        assert solution.status == "ok"
        p, xi = model.predicted(p, xi, held, 1)
        worst = max(worst, crossing(spaces, p + formation))
    assert -0.02 < worst <= 1e-9


@pytest.mark.parametrize("certificate_of", ["directional_ball", "predictive"])
def test_the_certified_point_is_the_centralized_optimum_of_the_same_rows(certificate_of: str) -> None:
    team, rng = team_of("ring of 5"), np.random.default_rng(15)
    model, n, formation = model_of(team), 5, 0.5 * np.random.default_rng(3).normal(size=(5, 2))
    certificate = (
        DirectionalBall(formation, model.growth, 0.0)
        if certificate_of == "directional_ball"
        else PredictiveCertificate(PredictionGrid.of(model), formation, 0.0)
    )
    solver, solved = CentralizedGovernor(ClarabelSolver()), 0
    for _ in range(60):
        p = 0.1 * rng.normal(size=(n, 2))
        held = p.mean(axis=0)
        spaces = half_spaces_of(rng, n, 1, np.zeros(2), 6.0)
        rows = certificate.rows_at(spaces, p, 0.05 * rng.normal(size=(n, 2)), held)
        problem = Problem(team, p, np.zeros((n, 2)), rows, 3 * rng.normal(size=2))
        ours, _ = CertifiedGovernor((), 2, np.inf).step(problem, held)
        theirs, _ = solver.step(problem, held)
        assert (ours.status == "infeasible") == (theirs.status == "infeasible")
        if ours.status == "ok":
            solved += 1
            np.testing.assert_allclose(ours.m[0], theirs.m[0], atol=1e-5)
    assert 10 < solved < 60


def test_the_directional_ball_is_an_interval_found_by_brute_force_too() -> None:
    rng, empty = np.random.default_rng(16), 0
    for _ in range(300):
        n = int(rng.integers(1, 7))
        e, xi = rng.normal(size=n), rng.normal(size=n)
        gamma, room = 1.0 + 0.05 * rng.random() * (rng.random() < 0.5), rng.uniform(-1.0, 4.0)
        z = np.linspace(-8.0, 8.0, 40001)
        norms = np.sqrt(((e[:, None] - z) ** 2).sum(axis=0) + (xi**2).sum())
        allowed = z[gamma * norms + z <= room]
        low, high = interval(n, e.sum(), (e**2).sum() + (xi**2).sum(), gamma, room)
        if not len(allowed):
            empty += 1
            assert low > high - 1e-3
            at_mean = gamma * np.sqrt(((e - e.mean()) ** 2).sum() + (xi**2).sum()) + e.mean() - room
            assert (low - high) / 2 == pytest.approx(at_mean, abs=1e-12)
            assert room - (low + high) / 2 == pytest.approx(at_mean, abs=1e-12)  # to spare in formation
            continue
        assert high == pytest.approx(allowed[-1], abs=1e-3)
        assert low == pytest.approx(allowed[0], abs=1e-3) or (low < -8.0 and allowed[0] == -8.0)
    assert empty > 20


def test_the_norm_across_a_half_space_is_at_most_the_ball_and_never_grows() -> None:
    team, rng = team_of("ring of 5"), np.random.default_rng(17)
    model = model_of(team)
    p, xi, m = rng.normal(size=(5, 2)), rng.normal(size=(5, 2)), rng.normal(size=2)
    G = np.array([0.6, 0.8])
    rho = np.sqrt(((p - m) ** 2).sum() + (xi**2).sum())
    norms = []
    for _ in range(500):
        norms.append(np.sqrt((((p - m) @ G) ** 2).sum() + ((xi @ G) ** 2).sum()))
        p, xi = model.predicted(p, xi, m, 1)
    assert norms[0] <= rho
    assert max(norms) <= model.growth * norms[0]


def test_the_nearest_allowed_point_is_the_quadratic_programs() -> None:
    from scipy.optimize import minimize

    rng, outside = np.random.default_rng(18), 0
    for _ in range(200):
        k = int(rng.integers(1, 8))
        angle = rng.uniform(0, 2 * np.pi, size=k)
        normals = np.column_stack([np.cos(angle), np.sin(angle)])
        offsets, target = rng.uniform(-0.5, 1.5, size=k), 3 * rng.normal(size=2)
        found, x, y = nearest_allowed(target[0], target[1], normals, offsets, 0.0)
        constraint = {"type": "ineq", "fun": lambda z, N=normals, b=offsets: b - N @ z, "jac": lambda z, N=normals: -N}
        theirs = minimize(
            lambda z, t=target: ((z - t) ** 2).sum(), np.zeros(2), constraints=constraint, method="SLSQP", tol=1e-12
        )
        if not found:
            outside += 1
            assert not theirs.success or (normals @ theirs.x - offsets).max() > 1e-8
            x, y = least_violating(normals, offsets, np.inf)
            worst = (normals @ [x, y] - offsets).max()
            assert worst > 0
            push = minimize(
                lambda z: z[2],
                np.array([0.0, 0.0, 5.0]),
                method="SLSQP",
                tol=1e-12,
                constraints={"type": "ineq", "fun": lambda z, N=normals, b=offsets: b + z[2] - N @ z[:2]},
            )
            assert worst == pytest.approx(push.x[2], abs=1e-6)
        else:
            assert (normals @ [x, y] - offsets).max() <= 1e-9
            np.testing.assert_allclose([x, y], theirs.x, atol=1e-5)
    assert 5 < outside < 150


def test_rows_that_all_but_contradict_each_other_send_nobody_far_away() -> None:
    """Where only far points meet them: the least worst violation near the team, against a cone program."""
    import cvxpy as cp

    rng, far = np.random.default_rng(61), 0
    for _ in range(60):
        angle, turned, reach = rng.uniform(0, 2 * np.pi), rng.uniform(1e-3, 1.0), 10.0 ** rng.uniform(-1, 1)
        angles = np.array([angle, angle + np.pi - turned])
        normals, offsets = np.column_stack([np.cos(angles), np.sin(angles)]), rng.uniform(-0.5, 0.1, size=2)
        found, x, y = nearest_allowed(0.0, 0.0, normals, offsets, 0.0)
        radius = search_radius(offsets, reach)
        assert radius == min(reach, 10.0 * max(0.0, -offsets.min()))
        assert near_allowed(normals, offsets, offsets, reach) == (found and np.hypot(x, y) <= radius)
        if near_allowed(normals, offsets, offsets, reach):
            continue
        far += found
        x, y = least_violating(normals, offsets, radius)
        z, worst = cp.Variable(2), cp.Variable()
        cp.Problem(cp.Minimize(worst), [normals @ z <= offsets + worst, cp.norm(z) <= radius]).solve(cp.CLARABEL)
        assert np.hypot(x, y) <= radius * (1 + 1e-12)
        assert (normals @ [x, y] - offsets).max() == pytest.approx(worst.value, abs=1e-6)
    assert far > 10


def test_where_all_rows_are_tight_the_held_point_is_found() -> None:
    angle = np.linspace(0, 2 * np.pi, 30)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    found, x, y = nearest_allowed(3.0, -4.0, normals, np.zeros(30), 0.0)
    assert found
    assert np.hypot(x, y) <= 1e-8


@pytest.mark.parametrize("facets", [wheel_facets(load_robot_model()), disc_facets(0.4, 8)])
def test_the_share_is_the_largest_that_the_wheels_can_follow(facets: np.ndarray) -> None:
    """Headings as predicted while m is held; against a search over shares with the velocities simulated."""
    team, rng = team_of("ring of 5"), np.random.default_rng(19)
    model, n = model_of(team), 5
    grid = PredictionGrid.of(model)
    limit = SpeedLimit.of(model, grid, facets, load_robot_model().hand_offset)
    partial = 0
    for _ in range(30):
        error = 0.15 * rng.normal(size=(2 * n, 2))
        heading, advance = rng.uniform(-np.pi, np.pi, size=n), rng.normal(size=2)
        kappa = limit.kappa(error, heading, advance)
        headings = turned(limit, error, heading)

        def use(kappa: float, error=error, headings=headings, advance=advance) -> np.ndarray:
            moved = error.copy()
            moved[:n] -= kappa * advance
            u = (limit.U @ moved).reshape(len(limit.time), n, 2)
            c, s = np.cos(headings), np.sin(headings)
            body = np.stack([c * u[..., 0] + s * u[..., 1], c * u[..., 1] - s * u[..., 0]], axis=-1)
            return body @ facets.T

        before, at, beyond = use(0.0), use(kappa), use(kappa + 1e-4)
        allowed = np.maximum(before, 1.0) + 1e-9
        assert (at <= allowed).all()
        if kappa < 1.0:
            partial += 1
            assert (beyond > np.maximum(before, 1.0)).any()
    assert partial > 10


def test_an_advance_changes_velocities_by_no_more_than_motors_take_up() -> None:
    """Against the velocities of eq. 2 before and after, at rest and far from every other limit."""
    team, rng, facets, cut = team_of("ring of 5"), np.random.default_rng(29), wheel_facets(load_robot_model()), 0
    model, n = model_of(team), 5
    limit = SpeedLimit.of(model, PredictionGrid.of(model), facets, load_robot_model().hand_offset, facets / 0.1)
    for _ in range(30):
        error, heading = np.zeros((2 * n, 2)), rng.uniform(-np.pi, np.pi, size=n)
        advance = 0.08 * rng.normal(size=2)
        kappa = limit.kappa(error, heading, advance)
        moved = error.copy()
        moved[:n] -= kappa * advance
        u, c, s = model.rate @ moved, np.cos(heading), np.sin(heading)
        used = np.column_stack([c * u[:, 0] + s * u[:, 1], c * u[:, 1] - s * u[:, 0]]) @ facets.T
        assert used.max() <= 0.1 + 1e-12
        if kappa < 1.0:
            cut += 1
            assert used.max() == pytest.approx(0.1)
    assert 5 < cut < 30


def turned(limit: SpeedLimit, error: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return the headings (K, n) at the rows' times: fine Euler steps of dtheta/dt = |u| sin(beta) / offset."""
    n = len(heading)
    u = (limit.U @ error).reshape(len(limit.time), n, 2)
    theta, all_of_them = heading.copy(), [heading.copy()]
    for k in range(1, len(limit.time)):
        steps = 2000 if k < 20 else 200
        dt = (limit.time[k] - limit.time[k - 1]) / steps
        direction, speed = np.arctan2(u[k - 1, :, 1], u[k - 1, :, 0]), np.hypot(u[k - 1, :, 0], u[k - 1, :, 1])
        beta0 = direction - theta
        # tan(beta / 2) decays exponentially; checked against Euler steps while they are short
        exact = direction - 2 * np.arctan(np.tan(beta0 / 2) * np.exp(-speed * dt * steps / limit.offset))
        if k == 1:
            euler = theta.copy()
            for _ in range(steps):
                euler = euler + dt * speed * np.sin(direction - euler) / limit.offset
            np.testing.assert_allclose(np.cos(euler - exact), 1.0, atol=1e-5)
        theta = exact
        all_of_them.append(theta.copy())
    return np.array(all_of_them)


@pytest.mark.parametrize("name", GRAPHS)
def test_a_prediction_is_a_power_of_the_model_and_ends_when_the_error_is_small(name: str) -> None:
    model = model_of(team_of(name))
    ticks, power = model.settling_ticks(), np.linalg.matrix_power
    for t in (1, 2, 37, 1000):
        np.testing.assert_allclose(model.after(t), power(model.moving_part, t), atol=1e-13)
        np.testing.assert_allclose(model.after(t, model.rate), model.rate @ power(model.moving_part, t), atol=1e-12)
    assert np.linalg.norm(power(model.moving_part, ticks), 2) <= 1e-3 * (1 + 1e-9)
    assert np.linalg.norm(power(model.moving_part, ticks - 1), 2) > 1e-3 * (1 - 1e-9)


@pytest.mark.parametrize("tick", [0.41, 2.0, 1e6])
def test_a_team_that_diverges_between_ticks_has_no_prediction(tick: float) -> None:
    model = model_of(team_of("ring of 5"), tick=tick)
    with pytest.raises(ValueError, match="does not settle"):
        _ = model.growth
    with pytest.raises(ValueError, match="does not settle"):
        PredictionGrid.of(model)


def test_equal_teams_share_one_grid() -> None:
    one, other = (PredictionGrid.of(model_of(team_of("ring of 5"), tick=0.013)) for _ in range(2))
    assert one is other
    assert one is not PredictionGrid.of(model_of(team_of("ring of 5"), tick=0.014))
