"""Robots that keep their distance: the filter against an independent solver, and its theorem in the ideal plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import pbrg_mj as pbrg
from pbrg_mj.governor.certificate.speed import disc_facets, wheel_facets
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.interface import FORBIDDEN, Problem, Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter, separation
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.loop.tick_data import ControlTick
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.world.scene.robot import load_robot_model
from tests.filtering import driven_by

NOTHING = np.zeros((0, 2))


def filter_of(rng: np.random.Generator, n: int, facets: np.ndarray = NOTHING) -> SeparationFilter:
    formation = 2 * rng.normal(size=(n, 2))
    return SeparationFilter(formation, distance=0.3, margin=0.01, gain=2.0, facets=facets, tick=0.01)


def random_problem(rng: np.random.Generator, n: int, slots: int, q: np.ndarray) -> Problem:
    """Return a problem in which hand points q stand behind some half-spaces, and beyond others."""
    turn = rng.uniform(0, 2 * np.pi, (n, slots))
    G = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    h = np.einsum("ikx,ix->ik", G, q) + rng.uniform(-0.2, 1.0, (n, slots))
    active = rng.random((n, slots)) < 0.8
    spaces = HalfSpaces(G, h, active, active[:, :, None] & (rng.random((n, slots, n)) < 0.5))
    rows = Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))
    team = network_of_edges([(i, i + 1) for i in range(n - 1)], np.eye(n)[0])
    p, heading = rng.normal(size=(n, 2)), rng.uniform(-np.pi, np.pi, n)
    return Problem(team, p, np.zeros((n, 2)), rows, np.zeros(2), spaces, heading)


def rows_of(
    keeper: SeparationFilter, problem: Problem, q: np.ndarray, u: np.ndarray, j: int, status: Status = "ok"
) -> tuple[np.ndarray, np.ndarray]:
    """Return the half-planes of robot j as the module's docstring has them, without the retreats that they ask for."""
    spaces, s = problem.half_spaces, problem.p[j] + keeper.formation[j]
    assert spaces is not None
    normals, offsets = [], []
    for i in range(len(q)):
        if i != j:
            apart = np.linalg.norm(q[i] - q[j])
            normals.append((q[i] - q[j]) / apart)
            offsets.append(keeper.gain / 2 * max(apart - keeper.distance, 0.0))
    for i, k in np.argwhere(spaces.binds[:, :, j]):
        G, h = spaces.G[i, k], spaces.h[i, k] - keeper.margin
        ahead = s + keeper.tick * u[j]
        stays = G @ ahead <= h and status not in ("inadmissible", "infeasible")
        wanted = u[j] - keeper.gain * (q[j] - s)
        most = np.inf if spaces.closing_speeds[spaces.binds[:, :, j]].any() else G @ wanted
        room = min(G @ (ahead - q[j]) / keeper.tick, most) if stays else 0.0
        normals.append(G)
        c = spaces.closing_speeds[i, k]
        offsets.append(max(0.0, keeper.gain * (h - G @ q[j]) - c, 0.0 if c > 0.0 else room))
    return np.reshape(normals, (-1, 2)), np.array(offsets)


def ways_back(keeper: SeparationFilter, problem: Problem, q: np.ndarray, j: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how fast each of these half-planes asks robot j to go back, and by how much it may be exceeded [m/s]."""
    apart = np.delete(np.linalg.norm(q - q[j], axis=1), j)
    spaces, back = problem.half_spaces, list(keeper.gain / 2 * np.clip(keeper.distance - apart - 0.005, 0.0, 0.05))
    caps = back.copy()
    assert spaces is not None
    for i, k in np.argwhere(spaces.binds[:, :, j]):
        behind, c = spaces.h[i, k] - keeper.margin - spaces.G[i, k] @ q[j], spaces.closing_speeds[i, k]
        rests = keeper.gain * np.clip(-behind - 0.005, 0.0, 0.05)
        back.append(max(0.0, c - keeper.gain * behind) if c > 0.0 else rests)
        caps.append(np.inf if c > 0.0 else rests)
    return np.array(back), np.array(caps)


def least_excess(normals: np.ndarray, required: np.ndarray, caps: np.ndarray) -> float:
    """Return the least e for which some w has normals @ w <= required + min(e, caps), by a linear program."""
    rows = np.arange(len(required))
    A = np.zeros((2 * len(rows), 2 + len(rows) + 1))  # w, the rows' own excesses, e
    A[rows, :2], A[rows, 2 + rows] = normals, -1.0
    A[len(rows) + rows, 2 + rows], A[len(rows) + rows, -1] = 1.0, -1.0
    cost = np.eye(len(A.T))[-1]
    limits = [(None, None)] * 2 + [(0.0, float(cap)) for cap in caps] + [(0.0, None)]
    found = linprog(cost, A, np.concatenate([required, np.zeros(len(rows))]), bounds=limits)
    assert found.status == 0
    return float(found.fun)


def excesses(normals: np.ndarray, required: np.ndarray, retreats: np.ndarray, caps: np.ndarray) -> np.ndarray:
    """Return by how much rows are exceeded where not all retreats are to be had: first the same, then each by less."""
    excess = np.minimum(least_excess(normals, required, caps), caps)
    for k in np.argsort(-retreats, kind="stable"):
        if excess[k] > 0.0:
            most, excess[k] = excess[k], 0.0
            excess[k] = least_excess(normals, required + excess, most * np.eye(len(excess))[k])
    return excess


def check_by_quadratic_program(
    keeper: SeparationFilter, problem: Problem, q: np.ndarray, u: np.ndarray, status: Status
) -> tuple[int, int]:
    """Compare what robots drive with a solver's optimum; return how many get not what they want, and not all retreats.

    Where rows nearly face each other, they meet far away, and a bisection's error moves that point by much more.
    """
    import cvxpy

    changed = exceeded = 0
    driven = driven_by(keeper, problem, q, u, status)
    for j in range(len(q)):
        wanted = u[j] - keeper.gain * (q[j] - keeper.formation[j] - problem.p[j])
        normals, offsets = rows_of(keeper, problem, q, u, j, status)
        back, caps = ways_back(keeper, problem, q, j)
        excess, w = excesses(normals, offsets - back, back, caps), cvxpy.Variable(2)
        met = [normals @ w <= offsets - back + excess + (1e-6 if excess.any() else 0.0)]  # it may be a point
        cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(w - wanted)), met).solve("CLARABEL")
        assert w.value is not None
        assert (normals @ driven[j] <= offsets - back + excess.max(initial=0.0) + 1e-3).all() or not excess.any()
        if np.linalg.norm(w.value) < 1.0 or not excess.any():
            np.testing.assert_allclose(driven[j], w.value, atol=1e-3 if excess.any() else 1e-5)
        changed, exceeded = changed + (not np.allclose(driven[j], wanted)), exceeded + bool(excess.any())
    return changed, exceeded


@pytest.mark.parametrize("status", ["ok", "holding", "inadmissible", "infeasible"])
def test_the_filter_is_the_quadratic_program_of_an_independent_solver(status: Status) -> None:
    rng, n, counted = np.random.default_rng(301), 6, np.zeros(2, dtype=int)
    for _ in range(12):
        q, u = 0.4 * rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
        problem, keeper = random_problem(rng, n, 3, q), filter_of(rng, n)
        problem = replace(problem, p=q - keeper.formation - 0.3 * rng.normal(size=(n, 2)))
        counted += check_by_quadratic_program(keeper, problem, q, u, status)
    assert counted[0] > 40 and counted[1] > 0


def test_where_not_all_retreats_are_to_be_had_what_comes_is_exceeded_by_the_least_that_will_do() -> None:
    """One robot, and half-spaces on all sides of which some come: a solver's least excess, and then less of each."""
    rng, counted = np.random.default_rng(321), np.zeros(2, dtype=int)
    for _ in range(60):
        q, u = 0.4 * rng.normal(size=(1, 2)), rng.normal(size=(1, 2))
        problem, keeper = random_problem(rng, 1, 15, q), replace(filter_of(rng, 1), min_speed=0.01)
        assert problem.half_spaces is not None
        closing = rng.uniform(0.05, 0.4, (1, 15)) * (rng.random((1, 15)) < 0.7)
        problem = replace(problem, half_spaces=replace(problem.half_spaces, closing=closing))
        counted += check_by_quadratic_program(keeper, problem, q, u, "ok")
    assert counted[0] > 30 and counted[1] > 5


def test_between_two_that_come_a_robot_goes_where_it_is_as_badly_off_with_either() -> None:
    """Ahead something comes at 0.3 m/s and is there, behind another at 0.1, 0.1 m away: both by the same, 0.1 m/s."""
    keeper, G = replace(filter_of(np.random.default_rng(322), 1), gain=1.0, min_speed=0.01), np.array([1.0, 0.0])
    for aside, y in ((0.0, 0.0), (0.3, -0.3)):
        spaces = HalfSpaces(
            G=np.array([[G, -G, [0.0, 1.0]]]),
            h=keeper.margin + np.array([[0.0, 0.2, 5.0 if aside == 0.0 else 0.0]]),
            active=np.ones((1, 3), dtype=bool),
            binds=np.ones((1, 3, 1), dtype=bool),
            closing=np.array([[0.3, 0.1, aside]]),
        )
        problem = replace(coming_at(keeper, np.zeros((1, 2)), G, 0.0, 0.0), half_spaces=spaces)
        driven = driven_by(keeper, problem, np.zeros((1, 2)), np.zeros((1, 2)))[0]
        np.testing.assert_allclose(driven, [-0.2, y], atol=1e-3)


def test_who_is_beyond_a_half_space_at_rest_goes_back_but_not_for_its_noise() -> None:
    """At gamma times how far, less 5 mm and at most 5 cm; then it stays, whatever it wants."""
    keeper, G = filter_of(np.random.default_rng(317), 1), np.array([1.0, 0.0])
    for beyond, back in ((0.004, 0.0), (0.015, 0.01), (0.3, 0.05)):
        q = np.array([[keeper.margin + beyond, 0.0]])
        problem = coming_at(keeper, q, G, 2 * keeper.margin, 0.0)
        for wanted in (0.0, 1.0):
            driven = driven_by(keeper, problem, q, np.array([[wanted, 0.0]]))
            np.testing.assert_allclose(driven, [[-keeper.gain * back, 0.0]], atol=1e-9)


def test_who_goes_back_goes_no_slower_than_motors_move() -> None:
    """What comes at 2 cm/s, too slowly to be told from rest, pushed its line over robots that stood."""
    keeper, G = replace(filter_of(np.random.default_rng(317), 1), min_speed=0.04), np.array([1.0, 0.0])
    for beyond, back in ((0.004, 0.0), (0.006, 0.04), (0.03, max(0.04, 0.025 * keeper.gain))):
        q = np.array([[keeper.margin + beyond, 0.0]])
        driven = driven_by(keeper, coming_at(keeper, q, G, 2 * keeper.margin, 0.0), q, np.zeros((1, 2)))
        np.testing.assert_allclose(driven, [[-back, 0.0]], atol=1e-9)


def test_who_goes_back_does_not_go_nearer_to_robots_than_is_allowed() -> None:
    """A robot stands behind it, a little farther away than the distance to keep, and it wants nothing."""
    keeper, G = filter_of(np.random.default_rng(318), 2), np.array([1.0, 0.0])
    for apart, back in ((0.3, 0.0), (0.32, 0.02), (0.4, 0.1)):
        q = np.array([[keeper.margin + 0.2, 0.0], [keeper.margin + 0.2 - apart, 0.0]])
        problem = coming_at(keeper, q, G, 2 * keeper.margin, 0.0)
        assert driven_by(keeper, problem, q, np.zeros((2, 2)))[0, 0] == pytest.approx(-back, abs=1e-4)


def test_two_that_are_too_near_go_apart_but_not_for_noise() -> None:
    """Each at gamma / 2 times how much nearer than d they are, less 5 mm, at most 5 cm, whatever they want."""
    keeper = filter_of(np.random.default_rng(323), 2)
    for lack, back in ((0.004, 0.0), (0.015, 0.01), (0.2, 0.05)):
        q = np.array([[0.0, 0.0], [keeper.distance - lack, 0.0]])
        problem = coming_at(keeper, q, np.array([0.0, 1.0]), 9.0, 0.0)
        for wanted in (0.0, 1.0):
            driven = driven_by(keeper, problem, q, np.array([[wanted, 0.0], [-wanted, 0.0]]))
            np.testing.assert_allclose(driven[:, 0], [-keeper.gain / 2 * back, keeper.gain / 2 * back], atol=1e-9)


def test_where_rows_forbid_m_nobody_follows_it_at_speed_to_what_stands() -> None:
    """What follows m goes 0.1 m on in a tick and stays behind the half-space; the robot goes there only if m may."""
    keeper, q, u = filter_of(np.random.default_rng(313), 1), np.zeros((1, 2)), np.array([[10.0, 0.0]])
    problem = coming_at(keeper, q, np.array([1.0, 0.0]), 0.2 + keeper.margin, 0.0)
    assert driven_by(keeper, problem, q, u)[0, 0] == pytest.approx(10.0)
    for status in FORBIDDEN:
        assert driven_by(keeper, problem, q, u, status)[0, 0] == pytest.approx(keeper.gain * 0.2)


@pytest.mark.parametrize("facets", [wheel_facets(load_robot_model()), disc_facets(0.4, 8)], ids=["wheels", "disc"])
def test_nobody_is_asked_for_more_than_wheels_can_do_and_rows_hold_all_the_same(facets: np.ndarray) -> None:
    rng, n = np.random.default_rng(302), 5
    for _ in range(40):
        q, u = 0.4 * rng.normal(size=(n, 2)), 3 * rng.normal(size=(n, 2))
        keeper = filter_of(rng, n, facets)
        problem = random_problem(rng, n, 3, q)
        assert problem.heading is not None
        driven = driven_by(keeper, problem, q, u)
        for j in range(n):
            normals, offsets = rows_of(keeper, problem, q, u, j)
            assert (normals @ driven[j] <= offsets + 1e-9).all()
            c, s = np.cos(problem.heading[j]), np.sin(problem.heading[j])
            assert (facets @ np.array([[c, s], [-s, c]]) @ driven[j] <= 1 + 1e-9).all()


def test_a_robot_needs_its_own_data_and_where_robots_beside_it_are() -> None:
    """Bit for bit: others' p, xi, u, headings and half-spaces of which it was not told say nothing to it."""
    rng, n, j = np.random.default_rng(303), 6, 2
    facets = disc_facets(0.5, 8)
    keeper = filter_of(rng, n, facets)
    reach = keeper.distance + 2 * 0.5 / keeper.gain / np.cos(np.pi / 8)
    for _ in range(30):
        q, u = 0.6 * rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
        problem = random_problem(rng, n, 3, q)
        ours = driven_by(keeper, problem, q, u)[j]
        others = np.arange(n) != j
        far = others & (np.linalg.norm(q - q[j], axis=1) > reach)
        spaces, heading = problem.half_spaces, problem.heading
        assert spaces is not None and heading is not None
        hidden = ~spaces.binds[:, :, j]
        scrambled = replace(
            problem,
            p=np.where(others[:, None], rng.normal(size=(n, 2)), problem.p),
            xi=rng.normal(size=(n, 2)),
            heading=np.where(others, 0.3, heading),
            half_spaces=replace(spaces, h=np.where(hidden, -9.0, spaces.h)),
        )
        moved = np.where(far[:, None], q[j] + 9.0 * (q - q[j]), q)
        theirs = driven_by(keeper, scrambled, moved, np.where(others[:, None], -u, u))[j]
        np.testing.assert_array_equal(ours, theirs)


def teams(seed: int, count: int) -> list[dict[str, object]]:
    """Return keys of random teams that would meet on the way to their formation."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        start, formation = rng.uniform(-1, 1, (4, 2)), rng.uniform(-1, 1, (4, 2))
        if min(closest(start), closest(formation)) > 0.3:
            team = {"start": start.tolist(), "formation": formation.tolist(), "leaders": [1]}
            found.append({"team": team, "operator.reference": rng.uniform(-1, 1, 2).tolist()})
    return found


def closest(q: np.ndarray) -> float:
    i, j = np.triu_indices(len(q), 1)
    return float(np.linalg.norm(q[i] - q[j], axis=1).min())


def run(keys: dict[str, object], distance: float | None, duration: float) -> tuple[Simulation, list[ControlTick]]:
    """Run a team in the ideal plant with m = r and one half-space beside everybody's start."""
    given = [{"robot": 1, "normal": [1.0, 0.2], "offset": 1.05}]
    keys = {"governor.kind": "none", "reference.solver": "none", "control.separation": distance, **keys}
    keys |= {"estimator.given": given, "estimator.scope": "team"}
    simulation = Simulation.build(pbrg.load("paper/simulation_near", keys, duration=duration).settings)
    return simulation, list(simulation.control_ticks())


def test_in_the_ideal_plant_nobody_meets_or_crosses_and_p_moves_by_eq_9() -> None:
    distance, met = 0.25, 0
    for keys in teams(304, 5):
        _, without = run(keys, None, 6.0)
        met += min(closest(tick.hand_world) for tick in without) < 0.9 * distance
        simulation, ticks = run(keys, distance, 6.0)
        model = TeamModel.of_scenario(simulation.loop.scenario)
        m, first = ticks[0].solution.m[0], ticks[0].problem
        G, storage = np.array([1.0, 0.2]) / np.hypot(1.0, 0.2), np.inf
        h = max(1.05 / np.hypot(1.0, 0.2), (ticks[0].hand_world @ G).max())
        for tick in ticks:
            assert closest(tick.hand_world) >= distance - 1e-12
            assert (tick.hand_world @ G).max() <= h + 1e-12
            p, xi = model.predicted(first.p, first.xi, m, tick.index) if tick.index % 100 == 0 else (None, None)
            if p is not None and xi is not None:
                np.testing.assert_allclose(tick.problem.p, p, atol=1e-10)
                np.testing.assert_allclose(tick.problem.xi, xi, atol=1e-10)
            now = ((tick.problem.p - m) ** 2).sum() / 2 + (tick.problem.xi**2).sum() / 2
            assert now <= storage + 1e-12
            storage = now
    assert met >= 2


def test_the_formation_is_reached_and_displacements_go() -> None:
    start = [[-0.8, 0.02], [0.8, 0.0], [0.0, 0.8]]
    team = {"start": start, "formation": [[0.8, 0.0], [-0.8, 0.0], [0.0, 0.8]], "leaders": [3]}
    _, ticks = run({"team": team, "operator.reference": [0.0, 0.0]}, 0.3, 20.0)
    displacements = [np.abs(tick.displacement).max() for tick in ticks if tick.displacement is not None]
    assert max(displacements) > 0.1 and displacements[-1] < 1e-6
    np.testing.assert_allclose(ticks[-1].hand_world, team["formation"], atol=1e-3)


def approach(w: np.ndarray, theta: float, normals: np.ndarray, offsets: np.ndarray) -> float:
    """Return by how much n.w exceeds the room of some row, at worst, while w turns by theta."""
    turned = np.exp(1j * theta * np.linspace(0.0, 1.0, 2001)) * complex(*w)
    return float(np.max(normals @ np.stack([turned.real, turned.imag]) - offsets[:, None], initial=-np.inf))


@pytest.mark.parametrize(("robots", "slots"), [(5, 0), (1, 4), (5, 3)], ids=["robots", "half-spaces", "both"])
@pytest.mark.parametrize("displaced", [0.0, 0.3])
def test_a_robot_that_turns_while_it_lags_goes_no_faster_than_its_rows_allow_then(
    robots: int, slots: int, displaced: float
) -> None:
    rng, n, slowed, left = np.random.default_rng(311), robots, 0, 0
    for _ in range(200 // n):
        q, u = 0.3 * rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
        problem, keeper = random_problem(rng, n, slots, q), filter_of(rng, n)
        problem = replace(problem, p=q - keeper.formation - displaced * rng.normal(size=(n, 2)))
        turning, slow = rng.uniform(0.2, 3.0), rng.uniform(0.01, 0.1)
        before = driven_by(replace(keeper, min_speed=slow), problem, q, u)
        after = driven_by(replace(keeper, turning=turning, min_speed=slow), problem, q, u)
        assert problem.heading is not None
        for j in range(n):
            normals, offsets = rows_of(keeper, problem, q, u, j)
            across = np.cos(problem.heading[j]) * before[j, 1] - np.sin(problem.heading[j]) * before[j, 0]
            speed = np.linalg.norm(before[j])
            share = np.linalg.norm(after[j]) / speed if speed > 0.0 else 1.0
            np.testing.assert_allclose(share * before[j], after[j], atol=1e-12)
            shares = share, 1.01 * share + 5e-4  # 12 bisections
            excess = [approach(one * before[j], one * turning * across, normals, offsets) for one in shares]
            if speed <= slow:
                assert share == 1.0
            elif share == pytest.approx(1.0, abs=1e-12):
                assert excess[0] < 2e-9
                left += 1
            else:
                assert excess[0] < 2e-9 or np.linalg.norm(after[j]) == pytest.approx(slow)
                assert excess[1] > 0
                slowed += 1
    assert slowed > 20
    assert left > 20


def test_a_robot_5_mm_from_its_place_turns_no_faster_at_a_wall_than_its_row_allows() -> None:
    """It could be there in a tick at 0.5 m/s, but wants 0.01: its turn brings it to the wall no faster than the row."""
    keeper = replace(filter_of(np.random.default_rng(324), 1), turning=3.0, min_speed=0.03)
    q, G, u = np.zeros((1, 2)), np.array([0.0, 1.0]), np.array([[-0.5, 0.0]])
    problem = coming_at(keeper, q, G, keeper.margin + 0.02, 0.0)
    p, downwards = problem.p + np.array([[0.0, 0.005]]), np.array([-np.pi / 2])
    problem = replace(problem, p=p, heading=downwards)  # its turn is one of -90 degrees
    driven = driven_by(keeper, problem, q, u)[0]
    theta = -keeper.turning * np.linalg.norm(driven)
    assert 0.05 < np.linalg.norm(driven) < 0.2
    assert approach(driven, theta, G[None], np.array([keeper.gain * 0.02])) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
def test_in_physics_a_robot_that_turns_beside_another_does_not_touch_it() -> None:
    scenario = pbrg.load("families/boards", {"set_up": "recommended"}, duration=2.5, seed=10209).settings
    simulation = Simulation.build(scenario)
    for _ in simulation.control_ticks():
        assert not simulation.loop.world.truth().robot_contact.any()


@pytest.mark.slow
def test_in_physics_a_robot_that_is_displaced_and_turns_beside_a_box_does_not_pass_its_line() -> None:
    """At 19 s robot 2, kept back by others, backs out of a notch between two boxes and turns about."""
    scenario = pbrg.load("families/boxes", {"set_up": "recommended"}, duration=21.0, seed=20306).settings
    simulation = Simulation.build(scenario)
    assert min(float(simulation.loop.world.truth().wall_margin.min()) for _ in simulation.control_ticks()) > 0.0


@pytest.mark.parametrize("name", ["paper/experiment_near", "paper/simulation_inadmissible", "scale/eight_robots"])
def test_the_papers_runs_are_not_filtered(name: str) -> None:
    loop = Simulation.build(pbrg.load(name).settings).loop
    assert separation(loop.scenario) is None and loop.velocity_filters == ()


def test_the_recommended_set_up_keeps_bodies_apart_or_what_the_formation_leaves() -> None:
    keys = {"governor.kind": "certified"}
    robot = load_robot_model()
    assert separation(pbrg.load("obstacles/corner", keys).settings) == 2 * robot.clearance + 0.02
    narrow = {**keys, "team.formation": [[0.0, 0.0], [0.15, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]}
    assert separation(pbrg.load("paper/experiment_near", narrow).settings) == 0.15
    assert separation(pbrg.load("paper/simulation_near", keys).settings) is None


def test_only_robots_that_turn_to_go_aside_are_slowed_by_turning() -> None:
    def of(name: str, robot: str) -> SeparationFilter:
        keys = {"control.separation": 0.3, "governor.kind": "certified", "robot": robot}
        return SeparationFilter.of(pbrg.load(name, keys).settings, 0.0, NOTHING)

    model, turning = load_robot_model(), of("paper/experiment_near", "generic")
    assert turning.turning == pytest.approx(0.25 / turning.gain / model.hand_offset)
    assert turning.min_speed * 0.25 / turning.gain * np.pi / 2 == pytest.approx(0.02)
    assert of("paper/simulation_near", "generic").turning == of("paper/experiment_near", "omni").turning == 0.0


def test_behind_all_that_lags_an_approach_is_critically_damped() -> None:
    """gamma = 1 / (4 tau): tau x'' + x' + gamma x = 0 has a double root; and gamma tick <= 1 at any tick."""
    delays = {"sensors.camera.delay": 0.1, "radio.delay": 0.05, "radio.jitter": 0.03, "control.separation": 0.2}
    late = pbrg.load("paper/experiment_near", delays).settings
    gain = SeparationFilter.of(late, 0.0, NOTHING).gain
    tau = 0.01 + load_robot_model().time_constant + 1 / 30 + 0.1 + 0.05 + 0.03
    np.testing.assert_allclose(np.roots([tau, 1.0, gain]), -1 / (2 * tau), rtol=1e-6)
    ideal = pbrg.load("paper/simulation_near", {"control.separation": 0.2, "timing.tick": 0.1}).settings
    assert SeparationFilter.of(ideal, 0.0, NOTHING).gain * 0.1 == 0.25


def test_a_formation_nearer_than_its_robots_may_be_is_refused() -> None:
    with pytest.raises(pbrg.InputError, match=r"control.separation: is 1.1 m, and robots 1 and 3 .* are 1 m apart"):
        pbrg.load(
            "paper/experiment_near",
            {"control.separation": 1.1, "team.formation": [[0, 0], [3, 0], [1, 0], [6, 0], [9, 0]]},
        )


@pytest.mark.slow
def test_in_physics_two_robots_change_places_with_it_and_touch_without_it() -> None:
    team = {"start": [[-0.6, 0.0], [0.6, 0.02]], "formation": [[0.6, 0.0], [-0.6, 0.0]], "leaders": [1]}
    team["heading_deg"] = [0.0, 180.0]
    keys = {"team": team, "graph.kind": "complete", "governor.kind": "certified", "sensors.beams.robots": [1]}
    keys |= {"operator.reference": [0.0, 0.0], "reference.solver": "none", "world.walls": []}
    touched = {}
    for distance in ("auto", None):
        scenario = pbrg.load("paper/experiment_near", {**keys, "control.separation": distance}, duration=6.0).settings
        simulation = Simulation.build(scenario)
        truths = [simulation.loop.world.truth() for _ in simulation.control_ticks()]
        touched[distance] = any(truth.robot_contact.any() for truth in truths)
        arrived = np.linalg.norm(truths[-1].hand_world - team["formation"], axis=1).max() < 0.05
        assert arrived == (distance == "auto")
    assert touched == {"auto": False, None: True}


def coming_at(keeper: SeparationFilter, q: np.ndarray, G: np.ndarray, h: float, closing: float) -> Problem:
    """Return a problem in which one half-space binds robot 1 and comes nearer."""
    n = len(q)
    spaces = HalfSpaces(
        G=np.tile(G, (n, 1, 1)),
        h=np.full((n, 1), h),
        active=np.eye(n, 1, dtype=bool),
        binds=np.eye(n, 1, dtype=bool)[:, :, None] & np.eye(n, dtype=bool)[:, None],
        closing=np.full((n, 1), closing),
    )
    rows = Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))
    team = network_of_edges([(i, i + 1) for i in range(n - 1)], np.eye(n)[0])
    return Problem(team, q - keeper.formation, np.zeros((n, 2)), rows, np.zeros(2), spaces, np.zeros(n))


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.5])
def test_nobody_is_caught_by_a_half_space_that_comes_as_fast_as_is_known(turn: float) -> None:
    """h - G.q falls by the factor 1 - gamma tick a tick at most, whatever u asks for: it stays positive."""
    rng = np.random.default_rng(304)
    keeper, G, speed = filter_of(rng, 2), np.array([np.cos(turn), np.sin(turn)]), 0.3
    q, h = np.array([[0.0, 0.0], [5.0, 5.0]]), 0.5
    for _ in range(600):
        behind = h - keeper.margin - G @ q[0]
        driven = driven_by(keeper, coming_at(keeper, q, G, h, speed), q, rng.normal(size=(2, 2)) + G)
        q, h = q + keeper.tick * driven, h - keeper.tick * speed
        assert h - keeper.margin - G @ q[0] >= behind * (1 - keeper.gain * keeper.tick) - 1e-9
    assert G @ q[0] < -1.0


def test_who_is_pushed_back_does_not_go_slower_because_it_turns_beside_what_stands() -> None:
    """A wall on the left that a retreat turns towards; without the retreat it slows the same velocity down."""
    rng = np.random.default_rng(306)
    keeper, q = filter_of(rng, 1), np.zeros((1, 2))
    turning, ahead, left = replace(keeper, turning=5.0), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    for closing, slowed in ((0.3, False), (0.0, True)):
        problem = coming_at(keeper, q, ahead, keeper.margin, closing)
        spaces = problem.half_spaces
        assert spaces is not None
        beside = HalfSpaces(
            G=np.concatenate([spaces.G, left[None, None]], axis=1),
            h=np.concatenate([spaces.h, [[keeper.margin + 0.02]]], axis=1),
            active=np.ones((1, 2), dtype=bool),
            binds=np.ones((1, 2, 1), dtype=bool),
            closing=np.array([[closing, 0.0]]),
        )
        problem = replace(problem, half_spaces=beside, heading=np.array([-0.5 * np.pi]))
        u = np.array([[-0.3, 0.0]])
        straight, turned = (driven_by(one, problem, q, u) for one in (keeper, turning))
        np.testing.assert_allclose(straight, u, atol=1e-9)
        assert (turned[0, 0] > -0.2) == slowed


def test_who_is_pushed_back_does_besides_only_what_its_turn_leaves() -> None:
    """Of what is asked for the largest share with which the turn takes no more of the retreat than is to spare."""
    rng, counted = np.random.default_rng(312), {"all": 0, "some": 0, "none": 0}
    for _ in range(300):
        keeper, q, slow = filter_of(rng, 1), np.zeros((1, 2)), rng.uniform(0.02, 0.1)
        turning, angle, closing = rng.uniform(0.5, 5.0), rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.3)
        G = np.array([np.cos(angle), np.sin(angle)])
        problem = coming_at(keeper, q, G, keeper.margin + rng.uniform(0.0, 0.04), closing)
        problem = replace(problem, heading=rng.uniform(0, 2 * np.pi, 1))
        spaces, heading = problem.half_spaces, problem.heading
        assert spaces is not None and heading is not None
        normals, offsets = G[None], np.array([keeper.gain * (spaces.h[0, 0] - keeper.margin) - closing])
        wanted = rng.normal(size=(1, 2))
        driven = driven_by(replace(keeper, turning=turning, min_speed=slow), problem, q, wanted)[0]
        whole = driven_by(keeper, problem, q, wanted)[0]
        across = np.cos(heading[0]) * driven[1] - np.sin(heading[0]) * driven[0]
        excess = approach(driven, turning * across, normals, offsets)
        if offsets[0] < 0.0 and abs(driven[0] * G[1] - driven[1] * G[0]) < 1e-3 and excess > slow:
            np.testing.assert_allclose(driven, offsets * G, atol=1e-3)  # the retreat alone, which turns away less
            counted["none"] += 1
            continue
        assert normals @ driven <= offsets + 1e-9
        assert excess <= slow + 1e-9
        if np.allclose(driven, whole, atol=1e-12):
            counted["all"] += 1
        else:
            assert excess > slow - 1e-2
            counted["some"] += 1
    assert min(counted["all"], counted["some"]) > 50
    assert counted["none"] > 0


def test_a_robot_between_two_that_come_does_not_race_along_both() -> None:
    """Their rows meet far away, in a way along both: 0.6 m/s for 5 cm/s of retreat, and its turn leads into one."""
    keeper = replace(filter_of(np.random.default_rng(319), 1), gain=1.7, turning=1.5, min_speed=0.05)
    q, angle = np.zeros((1, 2)), 0.05
    problem = coming_at(keeper, q, np.array([1.0, 0.0]), keeper.margin, 0.05)
    spaces = problem.half_spaces
    assert spaces is not None
    both = HalfSpaces(
        G=np.array([[[1.0, 0.0], [-np.cos(angle), np.sin(angle)]]]),
        h=np.full((1, 2), keeper.margin),
        active=np.ones((1, 2), dtype=bool),
        binds=np.ones((1, 2, 1), dtype=bool),
        closing=np.full((1, 2), 0.05),
    )
    along = replace(problem, half_spaces=both, heading=np.array([-0.5 * np.pi]))  # it heads where it has to go
    assert driven_by(keeper, along, q, np.zeros((1, 2)))[0, 1] < -0.6
    across = replace(along, heading=np.array([0.0]))
    driven = driven_by(keeper, across, q, np.zeros((1, 2)))[0]
    offsets = np.zeros(2)
    assert approach(driven, keeper.turning * driven[1], both.G[0], offsets) <= keeper.min_speed + 1e-9
    assert 0.02 < np.linalg.norm(driven) < 1.0


def test_a_retreat_takes_what_another_robot_leaves_of_it() -> None:
    """A robot behind it, as near as is allowed, does not move: of the retreat nothing is left, aside is."""
    rng = np.random.default_rng(305)
    keeper, G = filter_of(rng, 2), np.array([1.0, 0.0])
    for behind, left in ((0.3, 0.0), (0.35, 0.1)):
        q = np.array([[0.0, 0.0], [-behind, 0.0]])
        driven = driven_by(keeper, coming_at(keeper, q, G, keeper.margin, 0.2), q, np.zeros((2, 2)))
        assert driven[0, 0] == pytest.approx(-left, abs=1e-4)
        aside = driven_by(keeper, coming_at(keeper, q, G, keeper.margin, 0.2), q, np.eye(2)[::-1])
        assert aside[0, 0] == pytest.approx(-left, abs=1e-4)
        assert aside[0, 1] > 0.5


def test_who_is_pushed_back_has_the_right_of_way() -> None:
    """It goes towards another robot at gamma times what is left of their distance; the other, or at rest, at half."""
    rng = np.random.default_rng(307)
    keeper, ahead = filter_of(rng, 2), np.array([1.0, 0.0])
    q, u = np.array([[0.0, 0.0], [-0.4, 0.0]]), np.array([[-0.5, 0.0], [0.5, 0.0]])
    for closing, rate in ((0.3, 1.0), (0.0, 0.5)):
        driven = driven_by(keeper, coming_at(keeper, q, ahead, keeper.margin, closing), q, u)
        np.testing.assert_allclose(driven[:, 0], [-rate * keeper.gain * 0.1, 0.5 * keeper.gain * 0.1], atol=1e-9)


def all_see(problem: Problem) -> Problem:
    """Return the problem of `coming_at` in which every robot knows the half-space that comes."""
    spaces, n = problem.half_spaces, len(problem.p)
    assert spaces is not None
    return replace(
        problem,
        half_spaces=replace(spaces, active=np.ones((n, 1), dtype=bool), binds=np.eye(n, dtype=bool)[:, None]),
    )


@pytest.mark.parametrize("sees", [True, False])
@pytest.mark.parametrize("closing", [0.1, 0.4])
def test_a_team_mate_makes_room_for_who_is_pushed_back_towards_it(closing: float, sees: bool) -> None:
    """In the ideal plant, and with a team-mate as near as is allowed at first. One that sees nothing is in the way."""
    rng = np.random.default_rng(309)
    keeper, G, h = filter_of(rng, 2), np.array([0.6, 0.8]), 1.0
    q = np.array([[0.0, 0.0], -(keeper.distance + 1e-6) * G])
    least = np.inf
    for _ in range(3000):
        problem = coming_at(keeper, q, G, h, closing)
        driven = driven_by(keeper, all_see(problem) if sees else problem, q, np.zeros((2, 2)))
        q, h = q + keeper.tick * driven, h - keeper.tick * closing
        least = min(least, h - keeper.margin - G @ q[0])
        assert closest(q) >= keeper.distance - 1e-12
    assert (least >= -1e-6) == sees
    assert not sees or closest(q) - keeper.distance == pytest.approx(closing / keeper.gain, rel=0.05)


def test_a_robot_makes_room_for_nobody_on_the_other_side_of_what_comes_or_farther_from_it() -> None:
    rng = np.random.default_rng(310)
    keeper, G = filter_of(rng, 2), np.array([1.0, 0.0])
    for x, moves in ((0.35, True), (0.9, False), (-0.35, False)):
        q = np.array([[0.0, 0.0], [x, 0.0]])
        h = keeper.margin + (0.4 if x < 0.5 else 0.3)  # robot 0 is pushed back from 0.2 m on
        problem = all_see(coming_at(keeper, q, G, h, 0.4))
        driven = driven_by(keeper, problem, q, np.zeros((2, 2)))
        assert (driven[0, 0] < 0.0) == moves


@pytest.mark.parametrize(("ahead", "retreats"), [(0.0, True), (5.0, False)])
def test_its_own_retreat_comes_before_room_for_others(ahead: float, retreats: bool) -> None:
    """Something pushes a robot towards a team-mate that something else pushes towards it: neither stands still.

    The two ask for opposite velocities, of which no share is to be had. What is still far away asks for none.
    """
    keeper, G = replace(filter_of(np.random.default_rng(320), 2), gain=1.7, distance=0.22), np.array([1.0, 0.0])
    q = np.array([[0.0, 0.0], [-0.3, 0.0]])
    both = HalfSpaces(
        G=np.array([[G, -G]] * 2),
        h=np.array([[keeper.margin + ahead, keeper.margin + 0.3]] * 2),
        active=np.ones((2, 2), dtype=bool),
        binds=np.repeat(np.eye(2, dtype=bool)[:, None], 2, axis=1),
        closing=np.full((2, 2), 0.3),
    )
    problem = replace(coming_at(keeper, q, G, keeper.margin, 0.3), half_spaces=both)
    driven = driven_by(keeper, problem, q, np.zeros((2, 2)))
    assert driven[0, 0] < -0.05 if retreats else driven[0, 0] > 0.05


@pytest.mark.parametrize(("y", "moves"), [(0.1, True), (0.3, False), (-0.3, False)])
def test_a_robot_makes_room_for_nobody_beside_what_comes(y: float, moves: bool) -> None:
    """A face 0.4 m long comes at both robots, and the one nearer to it is within its ends or not."""
    rng = np.random.default_rng(316)
    keeper = filter_of(rng, 2)
    q = np.array([[0.0, 0.0], [0.35, y]])
    problem = all_see(coming_at(keeper, q, np.array([1.0, 0.0]), keeper.margin + 0.4, 0.4))
    assert problem.half_spaces is not None
    face = replace(problem.half_spaces, spans=np.full((2, 1, 2), [-0.2, 0.2]))
    driven = driven_by(keeper, replace(problem, half_spaces=face), q, np.zeros((2, 2)))
    assert (driven[0, 0] < 0.0) == moves


def test_two_that_are_pushed_at_each_other_keep_their_distance() -> None:
    """In the ideal plant, with 2 gamma tick = 1: each takes all of gamma, and half-spaces come from either side."""
    rng = np.random.default_rng(308)
    keeper = filter_of(rng, 2)
    keeper = replace(keeper, tick=0.5 / keeper.gain)
    q, G = np.array([[0.4, 0.0], [-0.4, 0.0]]), np.array([[[1.0, 0.0]], [[-1.0, 0.0]]])
    for _ in range(3):
        problem = coming_at(keeper, q, G[0, 0], 0.0, 0.5)
        spaces = problem.half_spaces
        assert spaces is not None
        h = np.einsum("ikx,ix->ik", G, q)
        problem = replace(
            problem,
            half_spaces=replace(
                spaces, G=G, h=h, active=np.ones((2, 1), dtype=bool), binds=np.eye(2, dtype=bool)[:, None]
            ),
        )
        q = q + keeper.tick * driven_by(keeper, problem, q, np.zeros((2, 2)))
        assert closest(q) >= keeper.distance - 1e-12
    assert closest(q) < keeper.distance + 1e-3


@pytest.mark.slow
def test_in_physics_a_robot_that_a_box_pushes_at_its_team_mates_gets_out_of_its_way() -> None:
    scenario = pbrg.load("families/moving_boxes", {"set_up": "recommended"}, duration=6.0, seed=61013).settings
    simulation = Simulation.build(scenario)
    for _ in simulation.control_ticks():
        truth = simulation.loop.world.truth()
        assert not truth.moving_contact.any() and not truth.robot_contact.any()


@pytest.mark.slow
def test_in_physics_a_team_of_which_a_box_leaves_no_admissible_reference_keeps_off_what_stands() -> None:
    """A robot followed such a reference at 0.5 m/s to a box at rest, 6 cm ahead."""
    scenario = pbrg.load("families/combined", {"set_up": "recommended"}, duration=7.0, seed=300015).settings
    simulation, statuses = Simulation.build(scenario), set()
    for tick in simulation.control_ticks():
        statuses.add(tick.solution.status)
        truth = simulation.loop.world.truth()
        assert not truth.wall_contact.any() and truth.wall_margin.min() > 0.0
    assert "infeasible" in statuses
