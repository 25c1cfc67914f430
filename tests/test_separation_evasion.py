"""Out of the way of what comes: where robots would be pressed against something, by geometry written anew here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.velocity_filter.evasion import AHEAD, FASTEST, evasive_closing_speeds, evasive_velocity
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network_of_edges
from tests.filtering import driven_by

CLEARANCE, DISTANCE, MARGIN = 0.1, 0.22, 0.01
WHEELS = 0.0, np.zeros((0, 2))  # heading [rad] and no limit but FASTEST


def known_to_one(rows: list[tuple[np.ndarray, float, float, tuple[float, float]]], robots: int = 1) -> HalfSpaces:
    """Half-spaces (G, h, closing, span) that bind robot 0 alone, and which it alone knows."""
    G, h, closing = np.zeros((robots, len(rows), 2)), np.zeros((robots, len(rows))), np.zeros((robots, len(rows)))
    spans, active = np.zeros(G.shape), np.zeros(h.shape, dtype=bool)
    binds = np.zeros((*h.shape, robots), dtype=bool)
    for k, (normal, offset, speed, span) in enumerate(rows):
        G[0, k], h[0, k], closing[0, k], spans[0, k] = normal, offset, speed, span
        active[0, k] = binds[0, k, 0] = True
    return HalfSpaces(G, h, active, binds, closing, spans)


def turned(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def corridor(rng: np.random.Generator, angle: float, mirrored: bool) -> tuple[HalfSpaces, np.ndarray, np.ndarray, bool]:
    """A face that comes along x and a wall behind, turned about the robot; its ends, and whether it is time to go."""
    ahead, behind, c = rng.uniform(-0.05, 0.3), rng.uniform(0.0, 0.4), rng.uniform(0.05, 0.3)
    low, high = -rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0)
    R = turned(angle) @ np.diag([1.0, -1.0 if mirrored else 1.0])
    q = rng.normal(size=2)
    G, back = R @ [1.0, 0.0], R @ [-1.0, 0.0]
    at = np.array([-G[1], G[0]]) @ q
    span = (at - high, at - low) if mirrored else (at + low, at + high)
    spaces = known_to_one([(G, G @ q + MARGIN + ahead, c, span), (back, back @ q + MARGIN + behind, 0.0, (0.0, 0.0))])
    speed = np.sqrt(FASTEST**2 - c**2)
    end = R @ [0.0, 1.0 if high < -low else -1.0]
    return spaces, q[None], speed * end, (max(ahead, 0.0) + behind) / c < min(high, -low) / speed + AHEAD


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_robot_goes_to_the_nearer_end_when_it_is_time_whatever_the_axes(mirrored: bool) -> None:
    rng, gone, wanted = np.random.default_rng(501), 0, (0.123, -0.3)
    for _ in range(400):
        spaces, q, out, time_to_go = corridor(rng, rng.uniform(-np.pi, np.pi), mirrored)
        evades, *found = evasive_velocity(spaces.arrays, q, 0, (DISTANCE, MARGIN), WHEELS, wanted)
        np.testing.assert_allclose(found, out if time_to_go else wanted, atol=1e-12)
        assert evades == time_to_go
        gone += time_to_go
    assert 100 < gone < 300


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_who_is_beside_the_face_or_sees_no_end_of_it_goes_where_it_wants(side: float) -> None:
    ahead, back = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    for span, leaves in (((-0.5, 0.4), True), ((0.01, 0.5), False), ((-np.inf, np.inf), False), ((0.0, 0.0), False)):
        span = span if side > 0.0 else (-span[1], -span[0])
        spaces = known_to_one([(ahead, 0.1, 0.2, span), (back, 0.1, 0.0, (0.0, 0.0))])
        evades, *found = evasive_velocity(spaces.arrays, np.zeros((1, 2)), 0, (DISTANCE, MARGIN), WHEELS, (0.0, 0.0))
        assert evades == leaves == any(found)
        assert not leaves or np.sign(found[1]) == side


def test_an_end_that_something_stands_before_is_no_way_out() -> None:
    """The nearer end is at y = 0.3; a wall there, or a robot, and the farther one is taken; both, and none is."""
    ahead, back, q = np.array([1.0, 0.0]), np.array([-1.0, 0.0]), np.array([[0.0, 0.0], [5.0, 5.0], [5.0, -5.0]])
    rows = [(ahead, 0.1, 0.2, (-0.4, 0.3)), (back, 0.1, 0.0, (0.0, 0.0))]
    wall = [(np.array([0.0, 1.0]), 0.2, 0.0, (0.0, 0.0))]
    for walls, mates, sign in ((0, (), 1), (1, (), -1), (0, (0.4,), -1), (0, (0.4, -0.3), 0), (1, (-0.4,), 0)):
        at = q.copy()
        for number, y in enumerate(mates, 1):
            at[number] = 0.05, y
        spaces = known_to_one(rows + walls * wall, robots=3)
        evades, *found = evasive_velocity(spaces.arrays, at, 0, (DISTANCE, MARGIN), WHEELS, (0.0, 0.0))
        assert np.sign(found[1]) == sign and evades == (sign != 0)


def test_robots_behind_and_what_comes_from_there_press_sooner_than_the_wall() -> None:
    ahead, back, far = np.array([1.0, 0.0]), np.array([-1.0, 0.0]), np.array([5.0, 5.0])
    for mate, speed, leaves in ((-5.0, 0.0, False), (-0.4, 0.0, True), (-5.0, 0.5, True)):
        spaces = known_to_one([(ahead, 0.1, 0.2, (-0.4, 0.3)), (back, 0.9, speed, (0.0, 0.0))], robots=2)
        q = np.array([[0.0, 0.0], [mate, 0.1] if mate > -5.0 else far])
        evades, *found = evasive_velocity(spaces.arrays, q, 0, (DISTANCE, MARGIN), WHEELS, (0.0, 0.0))
        assert evades == leaves == any(found)


def test_between_two_faces_that_come_the_end_of_either_is_a_way_out() -> None:
    """Which of the two is known first is no matter, and the end of the one that is nearer takes the robot out."""
    rng, counted = np.random.default_rng(503), {"one": 0, "other": 0}
    for _ in range(200):
        R, q = turned(rng.uniform(-np.pi, np.pi)), rng.normal(size=2)
        ahead, behind, ends = rng.uniform(-0.02, 0.1), rng.uniform(-0.02, 0.1), rng.uniform(0.1, 0.8, (2, 2))
        c = rng.uniform(0.1, 0.3, 2)
        rows = []
        for normal, gap, speed, (up, down) in zip(([1.0, 0.0], [-1.0, 0.0]), (ahead, behind), c, ends, strict=True):
            G = R @ normal
            at, upwards = np.array([-G[1], G[0]]) @ q, normal[0] > 0.0
            span = (at - down, at + up) if upwards else (at - up, at + down)
            rows.append((G, G @ q + MARGIN + gap, speed, span))
        speeds = np.sqrt(FASTEST**2 - c**2)
        times = ends / speeds[:, None]
        one, side = np.unravel_index(times.argmin(), times.shape)
        out = speeds[one] * (R @ [0.0, 1.0 if side == 0 else -1.0])
        assert (max(ahead, 0.0) + max(behind, 0.0)) / c.sum() < AHEAD
        for order in (rows, rows[::-1]):
            evades, *found = evasive_velocity(
                known_to_one(order).arrays, q[None], 0, (DISTANCE, MARGIN), WHEELS, (0.0, 0.0)
            )
            assert evades
            np.testing.assert_allclose(found, out, atol=1e-12)
        counted["one" if one == 0 else "other"] += 1
    assert min(counted.values()) > 50


def test_who_goes_out_of_the_way_has_the_right_of_way() -> None:
    """Towards a robot beside the way out it goes at gamma times what is left of their distance, not at half of that."""
    keeper = SeparationFilter(np.zeros((2, 2)), DISTANCE, MARGIN, 1.7, np.zeros((0, 2)), 0.02)
    team = network_of_edges([(0, 1)], np.ones(2))
    rows = Rows(np.zeros((2, 1)), np.zeros((2, 1, 2)), np.zeros((2, 1)), np.zeros((2, 1), dtype=bool))
    q = np.array([[0.0, 0.0], [-0.25, 0.3]])
    ahead, back = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    for span, rate in (((-0.5, 0.4), 1.0), ((-np.inf, np.inf), 0.5)):
        spaces = known_to_one([(ahead, 0.3, 0.25, span), (back, 0.05, 0.0, (0.0, 0.0))], robots=2)
        problem = Problem(team, q, np.zeros((2, 2)), rows, np.zeros(2), spaces, np.zeros(2))
        driven = driven_by(keeper, problem, q, np.array([[0.0, 1.0], [0.0, 0.0]]))
        towards = (q[1] - q[0]) / np.linalg.norm(q[1] - q[0])
        assert driven[0] @ towards == pytest.approx(rate * 1.7 * (np.linalg.norm(q[1] - q[0]) - DISTANCE), abs=1e-6)


def least_distance(size: np.ndarray, speed: float, gap: float, offset: float, ends: bool) -> float:
    """Return how near a box comes to an ideal robot [m] that wants to stay; it comes at the robot before a wall.

    Half-spaces are those of the box's nearest point and of the wall, speeds and spans those of its corners.
    """
    keeper = SeparationFilter(np.zeros((1, 2)), DISTANCE, MARGIN, 1.7, np.zeros((0, 2)), 0.02)
    q, center, least = np.zeros((1, 2)), np.array([gap + size[0] / 2, offset]), np.inf
    corners = 0.5 * size * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    rows = Rows(np.zeros((1, 1)), np.zeros((1, 1, 2)), np.zeros((1, 1)), np.zeros((1, 1), dtype=bool))
    team = network_of_edges([], np.ones(1))
    while center[0] > -0.2:
        near = np.clip(q[0], center - size / 2, center + size / 2)
        G, apart = near - q[0], float(np.linalg.norm(near - q[0]))
        least = min(least, apart)
        if apart < 1e-6:
            break
        G /= apart
        along = (center + corners) @ [-G[1], G[0]]
        span = (along.min() - CLEARANCE, along.max() + CLEARANCE) if ends else (-np.inf, np.inf)
        comes = (G, float(G @ near) - CLEARANCE, max(0.0, speed * G[0]), span)
        spaces = known_to_one([comes, (np.array([-1.0, 0.0]), 0.2, 0.0, (0.0, 0.0))])
        problem = Problem(team, q.copy(), np.zeros((1, 2)), rows, np.zeros(2), spaces, np.zeros(1))
        q = q + keeper.tick * driven_by(keeper, problem, q, np.zeros((1, 2)))
        center = center - [keeper.tick * speed, 0.0]
    return least


@pytest.mark.parametrize("ends", [True, False])
def test_a_box_that_comes_at_a_wall_catches_no_ideal_robot_that_knows_its_ends(ends: bool) -> None:
    """Boxes of 0.1 to 0.8 m at 0.05 to 0.3 m/s; without their ends all of them press the robot against the wall."""
    rng = np.random.default_rng(502)
    for _ in range(25):
        size, speed = rng.uniform(0.1, 0.8, 2), rng.uniform(0.05, 0.3)
        found = least_distance(size, speed, rng.uniform(0.5, 1.5), rng.uniform(-0.4, 0.4) * size[1], ends)
        assert found > CLEARANCE - 1e-3 if ends else found < 0.5 * CLEARANCE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "more", "needs_ends"),
    [(6242, 0, False), (6624, 0, False), (30123, 5, False), (30156, 5, False), (30159, 5, True)],
)
def test_in_physics_a_team_that_boxes_press_at_what_stands_and_at_each_other_gets_out_of_their_way(
    seed: int, more: int, needs_ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Teams among three boxes, and among some twelve, of which in one world some touch a robot without their ends."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "scripts")
    from measure_known_boxes import with_more_boxes
    from other_worlds.draw import scenario

    settings = pbrg.load(scenario("moving", seed), {"set_up": "recommended"}).settings
    settings = with_more_boxes(settings, seed, more)
    assert touched(settings) == 0.0
    if needs_ends:
        known = HalfSpaces.face_spans.fget
        assert known is not None
        monkeypatch.setattr(HalfSpaces, "face_spans", property(lambda spaces: known(replace(spaces, spans=None))))
        assert touched(settings) > 0.0


def touched(settings: Scenario) -> float:
    """Return for how many ticks a moving box touches some robot."""
    simulation = Simulation.build(settings)
    return sum(float(simulation.loop.world.truth().moving_contact.any()) for _ in simulation.control_ticks())


def beside_a_team_mate(ahead: float, back: float, turn: float, away: float) -> tuple[HalfSpaces, np.ndarray]:
    """A face that comes at 0.2 m/s along x at robot 1, a wall behind this, and robot 0, which knows both, beside it.

    Robot 0 is `away` [m] off, `turn` [rad] from along the face; this goes from 1 m below robot 1 to 0.3 m above it.
    """
    q = np.array([away * np.array([np.sin(turn), np.cos(turn)]), [0.0, 0.0]])
    face, wall = ([1.0, 0.0], MARGIN + ahead, 0.2, (-1.0, 0.3)), ([-1.0, 0.0], MARGIN + back, 0.0, (0.0, 0.0))
    return known_to_one([face, wall], 2), q


@pytest.mark.parametrize(
    ("ahead", "back", "turn", "makes_room"),
    [
        (0.1, 0.1, 0.0, True),  # pressed after 1 s, beside the face after 0.3 s: it goes within 1.4 s of that
        (0.1, 0.1, 0.6, True),
        (0.1, 0.1, np.pi - 0.6, True),  # it is on the other side, 1 m from the end: in time nevertheless
        (0.3, 0.3, 0.0, False),  # pressed after 3 s
        (-0.3, 0.1, 0.0, False),  # it is on the other side of what comes
    ],
)
def test_room_is_made_for_who_goes_out_of_the_way(ahead: float, back: float, turn: float, makes_room: bool) -> None:
    rng = np.random.default_rng(504)
    for angle in (0.0, *rng.uniform(-np.pi, np.pi, 20)):
        spaces, q = beside_a_team_mate(ahead, back, turn, 0.25)
        R, shift = turned(angle), rng.normal(size=2)
        G = spaces.G @ R.T
        tangents = np.stack([-G[..., 1], G[..., 0]], axis=-1)
        spans = spaces.spans + (tangents @ shift)[..., None]
        moved = replace(spaces, G=G, h=spaces.h + G @ shift, spans=spans)
        found = evasive_closing_speeds(moved.arrays, q @ R.T + shift, 0, (DISTANCE, MARGIN))
        np.testing.assert_allclose(found, [0.0, FASTEST * abs(np.cos(turn)) * makes_room], atol=1e-12)


def test_no_room_is_made_before_what_rests_or_ends_before_the_robot() -> None:
    spaces, q = beside_a_team_mate(0.1, 0.1, 0.0, 0.25)
    assert evasive_closing_speeds(spaces.arrays, q, 0, (DISTANCE, MARGIN))[1] == FASTEST
    for other in (
        replace(spaces, closing=0.0 * spaces.closing),
        replace(spaces, spans=spaces.spans + 1.1),
        replace(spaces, spans=np.where(spaces.spans == 0.3, np.inf, spaces.spans)),
        replace(spaces, active=np.zeros_like(spaces.active)),
    ):
        assert not evasive_closing_speeds(other.arrays, q, 0, (DISTANCE, MARGIN)).any()


@pytest.mark.parametrize(("ahead", "knows"), [(0.1, True), (0.3, True), (0.1, False)])
def test_a_team_mate_in_the_way_out_goes_before_it_is_come_near_to(ahead: float, knows: bool) -> None:
    """It rests at its place, farther off than robots keep: it goes as fast as whoever evades may come, if it knows."""
    keeper = SeparationFilter(np.zeros((2, 2)), DISTANCE, MARGIN, 1.7, np.zeros((0, 2)), 0.02)
    spaces, q = beside_a_team_mate(ahead, 0.1, 0.0, 0.25)
    spaces.binds[0] = [knows, True]
    spaces.spans[0, 0] = -1.0, 0.2  # the team-mate is beside the face and does not go out of its way itself
    rows = Rows(np.zeros((2, 1)), np.zeros((2, 1, 2)), np.zeros((2, 1)), np.zeros((2, 1), dtype=bool))
    problem = Problem(
        network_of_edges([(0, 1)], np.ones(2)), q, np.zeros((2, 2)), rows, np.zeros(2), spaces, np.zeros(2)
    )
    driven = driven_by(keeper, problem, q, np.zeros((2, 2)))
    presses = (ahead + 0.1) / 0.2 < 0.2 / FASTEST + AHEAD
    expected = FASTEST - 1.7 * (0.25 - DISTANCE) if knows and presses else 0.0
    np.testing.assert_allclose(driven[0, 1], expected, atol=1e-9)
