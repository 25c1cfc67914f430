from itertools import combinations

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.best_formation import best_formation, given_rows
from pbrg_mj.analysis.metrics.nearest_point import _corners, nearest
from pbrg_mj.analysis.metrics.obstacles import distance_to_obstacles, faces, footprints
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.robots import robot_size
from tests.runs import FORMATION, WALL, scenario, walled

CLEARANCE = robot_size().clearance


def planted(seed):
    """A reference whose nearest admissible point is known: r = m + sum of mu_k C_k over the active rows (KKT)."""
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(1, 7))
    angles = rng.uniform(0, 2 * np.pi, rows)
    C = np.column_stack([np.cos(angles), np.sin(angles)])
    m = rng.normal(size=2)
    active = np.arange(rows) < rng.integers(0, min(rows, 2) + 1)
    d = C @ m + np.where(active, 0.0, rng.uniform(0.1, 2.0, rows))
    r = m + np.where(active, rng.uniform(0.1, 2.0, rows), 0.0) @ C
    return r, C, d, m


def test_a_thousand_planted_optima_are_found():
    errors = [np.linalg.norm(nearest(r, C, d) - m) for r, C, d, m in map(planted, range(1000))]
    assert max(errors) < 1e-7


def test_three_rows_through_one_corner():
    C = np.array([[1.0, 0.0], [0.0, 1.0], [np.sqrt(0.5), np.sqrt(0.5)]])
    d = np.array([1.0, 1.0, np.sqrt(2.0)])
    np.testing.assert_allclose(nearest(np.array([3.0, 4.0]), C, d), [1.0, 1.0], atol=1e-12)


def test_no_room_between_two_walls():
    C = np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert nearest(np.zeros(2), C, np.array([-1.0, -1.0])) is None
    np.testing.assert_allclose(nearest(np.zeros(2), C, np.array([2.0, -2.0])), [2.0, 0.0], atol=1e-12)


def test_without_walls_the_reference_itself():
    plan = scenario(estimator={"source": "given"})
    np.testing.assert_array_equal(best_formation(plan, np.array([7.0, 8.0])).point, [7.0, 8.0])


def test_the_foremost_robot_binds_the_formation():
    """b = ((0, 0), (1, 0)): the second robot reaches x <= 2 when the reference point is at x = 1."""
    plan = scenario(team={"start": FORMATION, "formation": ((0.0, 0.0), (1.0, 0.0)), "leaders": (1,)})
    np.testing.assert_allclose(best_formation(plan, np.array([5.0, 3.0])).point, [1.0, 3.0], atol=1e-12)


def test_a_given_normal_may_have_any_length():
    plan = scenario(estimator={"source": "given", "given": ({"robot": 1, "normal": (3.0, 4.0), "offset": 10.0},)})
    rows = given_rows(plan)
    np.testing.assert_allclose(rows.G, [[0.6, 0.8]])
    np.testing.assert_allclose(rows.h, [2.0])


BOX = {"center": (3.0, 0.0), "size": (2.0, 1.0), "angle_deg": 90.0}  # x from 2.5 to 3.5, y from -1 to 1
DIAMOND = {"center": (3.0, 0.0), "size": (np.sqrt(2), np.sqrt(2)), "angle_deg": 45.0}  # |x - 3| + |y| <= 1


def team(*start, formation=None):
    return {"start": start, "formation": formation or ((0.0, 0.0),) * len(start), "leaders": (1,)}


def around(*, boxes=(), walls=(), start=((0.0, 0.0),), formation=None, scope="team"):
    world = {"boxes": boxes, "walls": walls}
    return scenario(plant="physics", world=world, team=team(*start, formation=formation), estimator={"scope": scope})


def best(plan, *r):
    return best_formation(plan, np.array(r))


def test_the_wall_s_face_that_looks_at_the_team_moved_inward():
    found = best(walled(), 5.0, 1.0)
    np.testing.assert_allclose(found.rows.G, [[1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(found.rows.h, [2.2 - CLEARANCE])
    np.testing.assert_allclose(found.point, [2.2 - CLEARANCE, 1.0], atol=1e-12)


@pytest.mark.parametrize(
    ("start", "normal", "offset"),
    [((9.0, 0.0), (-1.0, 0.0), -2.3), ((2.25, 8.0), (0.0, -1.0), -5.0), ((2.25, -8.0), (0.0, 1.0), -5.0)],
)
def test_a_wall_from_its_other_sides(start, normal, offset):
    found = best(walled(team=team(start)), 0.0, 0.0)
    np.testing.assert_allclose(found.rows.G, [normal], atol=1e-12)
    np.testing.assert_allclose(found.rows.h, [offset - CLEARANCE], atol=1e-12)


def test_turning_the_wall_round_changes_nothing():
    turned = {"from": WALL["to"], "to": WALL["from"], "thickness": 0.1}
    one, other = best(walled(), 5.0, 1.0), best(around(walls=(turned,)), 5.0, 1.0)
    np.testing.assert_allclose(one.point, other.point, atol=1e-12)


def test_faces_hold_what_is_outside_and_not_the_middle():
    G, h = faces(footprints(around(boxes=(BOX,))), 0)
    np.testing.assert_allclose(np.max(G @ [3.0, 0.0] - h), 1.0, atol=1e-12)  # half the length from the end faces
    np.testing.assert_allclose(np.min(G @ [3.0, 0.0] - h), 0.5, atol=1e-12)
    for q in ([2.5, 0.3], [3.5, 0.3], [3.1, 1.0], [3.1, -1.0]):
        assert np.abs(h - G @ q).min() == pytest.approx(0.0, abs=1e-12)  # each point lies on a face


def test_before_a_box_face_on():
    """The face x = 2.5 alone separates; r behind the box comes to x = 2.4, at r's own height."""
    found = best(around(boxes=(BOX,), start=((0.0, 0.0), (0.0, -0.5))), 4.0, 0.3)
    np.testing.assert_allclose(found.point, [2.5 - CLEARANCE, 0.3], atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_before_a_box_s_corner_the_nearer_of_two_faces_is_chosen(side):
    """Both faces of the diamond separate (0, 0); the planted foot of r on the side's face is the answer."""
    outward = np.array([-1.0, side]) / np.sqrt(2)
    foot = np.array([3.0, 0.0]) + (np.sqrt(0.5) + CLEARANCE) * outward + 0.2 * np.array([1.0, side]) / np.sqrt(2)
    found = best(around(boxes=(DIAMOND,)), *(foot - 0.3 * outward))
    np.testing.assert_allclose(found.point, foot, atol=1e-9)
    np.testing.assert_allclose(found.rows.G, [-outward], atol=1e-12)


def test_a_robot_round_the_corner_leaves_one_face():
    """The second robot stands past the lower face's plane: the upper face is all that is left, however far r is."""
    plan = around(boxes=(DIAMOND,), start=((0.0, 0.0), (2.5, 2.0)), formation=((0.0, 0.0), (0.0, 0.5)))
    found = best(plan, 3.0, -3.0)
    np.testing.assert_allclose(found.rows.G, [[np.sqrt(0.5), -np.sqrt(0.5)]], atol=1e-12)
    # y - x >= -2 + clearance sqrt(2) for the LOWER robot, which b = 0 makes m itself
    slack = found.point[1] - found.point[0] + 2.0 - CLEARANCE * np.sqrt(2)
    assert slack == pytest.approx(0.0, abs=1e-9)


def test_a_team_on_both_sides_has_no_target_and_a_reason():
    found = best(around(boxes=(BOX,), start=((0.0, 0.0), (5.0, 0.0))), 1.0, 0.0)
    assert found.point is None
    assert found.reason == "no face of boxes.0 separates the team's start from it"


def test_two_boxes_are_passed_by_the_best_pair_of_faces():
    """Against all pairs on a grid: no admissible point is nearer to r than the one found."""
    second = {"center": (1.0, 3.0), "size": (1.0, 1.0), "angle_deg": 30.0}
    plan = around(boxes=(DIAMOND, second))
    r = np.array([3.2, 1.9])
    found = best_formation(plan, r)
    shapes = footprints(plan)
    x, y = np.meshgrid(np.linspace(-1, 5, 241), np.linspace(-2, 5, 281))
    grid = np.column_stack([x.ravel(), y.ravel()])
    admitted = np.ones(len(grid), dtype=bool)
    for k in range(2):
        G, h = faces(shapes, k)
        usable = h >= 0.0  # the faces before which (0, 0) stands
        admitted &= np.any(grid @ G[usable].T <= h[usable] - CLEARANCE, axis=1)
    least = np.linalg.norm(grid[admitted] - r, axis=1).min()
    distance = np.linalg.norm(found.point - r)
    assert least - 0.025 * np.sqrt(2) <= distance <= least


def test_own_scope_admits_robots_on_both_sides():
    plan = around(boxes=(BOX,), start=((0.0, 0.0), (0.0, 2.0)), formation=((-1.5, 0.0), (1.5, 0.0)), scope="own")
    np.testing.assert_array_equal(best(plan, 3.0, 0.0).point, [3.0, 0.0])
    refused = best(plan, 1.5, 0.0)  # the second robot in the box
    assert refused.point is None
    assert "not convex" in refused.reason


@pytest.mark.parametrize(("x", "admitted"), [(2.5 - CLEARANCE - 1e-6, True), (2.5 - CLEARANCE + 1e-6, False)])
def test_own_scope_keeps_the_clearance(x, admitted):
    assert (best(around(boxes=(BOX,), scope="own"), x, 0.0).point is not None) == admitted


LONG = {"from": (2.25, -5.0), "to": (2.25, 5.0), "thickness": 0.1}  # its face at x = 2.2


def test_own_scope_stops_before_a_long_wall():
    """As `scope: team` does, exactly; all robots count, not the foremost alone."""
    start, formation = ((0.0, 0.0), (-0.5, 0.6), (-0.5, -0.6)), ((0.4, 0.0), (-0.2, 0.5), (-0.2, -0.5))
    own, team_scope = (around(walls=(LONG,), start=start, formation=formation, scope=one) for one in ("own", "team"))
    for r in ((3.2, 0.4), (2.9, -0.7), (3.4, 0.0)):
        found = best(own, *r).point
        np.testing.assert_allclose(found, best(team_scope, *r).point, atol=1e-9)
        np.testing.assert_allclose(found, [2.2 - CLEARANCE - 0.4, r[1]], atol=1e-9)


def test_the_paper_s_wall_parts_the_team_from_what_is_behind_it():
    plan = load_scenario("paper/experiment_inadmissible", ["set_up=recommended"]).scenario
    np.testing.assert_allclose(best(plan, 1.8, 2.0).point, [1.4, 1.6], atol=1e-6)


def test_own_scope_goes_round_what_is_on_the_way():
    """A box, a door, and a wall whose end is nearer to r than the start is."""
    door = ({"from": (2.25, -5.0), "to": (2.25, -0.5), "thickness": 0.1}, {"from": (2.25, 0.5), "to": (2.25, 5.0)})
    short = {"from": (2.25, -1.0), "to": (2.25, 1.0), "thickness": 0.1}
    for obstacles in ({"boxes": (BOX,)}, {"walls": door}, {"walls": (short,)}):
        found = best(around(**obstacles, scope="own"), 4.5, 0.2)
        np.testing.assert_array_equal(found.point, [4.5, 0.2])


def test_a_closed_room_is_not_left():
    """r is outside, beside a corner: the planted answer is the corner of the room, the clearance off both walls."""
    corners = ((-1.0, -1.0), (2.0, -1.0), (2.0, 1.5), (-1.0, 1.5))
    walls = tuple(
        {"from": a, "to": b, "thickness": 0.1} for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
    )
    found = best(around(walls=walls, scope="own"), 3.0, 2.5)
    np.testing.assert_allclose(found.point, [1.95 - CLEARANCE, 1.45 - CLEARANCE], atol=1e-9)


def test_a_column_that_fills_a_door_parts_within_a_cell():
    """The planted answer is in the bay beside it, on the wall's line and the column's circle, either side of it."""
    door = ({"from": (2.25, -5.0), "to": (2.25, -0.5), "thickness": 0.1}, {"from": (2.25, 0.5), "to": (2.25, 5.0)})
    world = {"walls": door, "columns": ({"center": (2.25, 0.0), "radius": 0.4},)}
    plan = scenario(plant="physics", world=world, team=team((0.0, 0.0)), estimator={"scope": "own"})
    found = best(plan, 3.5, 0.0).point
    planted = np.array([2.2 - CLEARANCE, np.sqrt((0.4 + CLEARANCE) ** 2 - 0.15**2)])
    assert np.linalg.norm([found[0], abs(found[1])] - planted) < 0.03
    assert distance_to_obstacles(plan, found[None]) >= CLEARANCE - 1e-9


def test_own_scope_seeks_no_place_that_is_too_far_away():
    for far in (20.0, 1e6):
        found = best(around(walls=(LONG,), scope="own"), far, 0.0)
        assert found.point is None
        assert "more than 15 m away" in str(found.reason)
        np.testing.assert_array_equal(best(around(scope="own"), far, 0.0).point, [far, 0.0])  # nothing is on the way


def test_own_scope_binds_a_given_half_space_to_its_robot_alone():
    given = ({"robot": 1, "normal": (1.0, 0.0), "offset": 2.0},)
    formation = ((0.0, 0.0), (1.0, 0.0))
    both, one = (
        scenario(team=team((0.0, 0.0), (1.0, 0.0), formation=formation), estimator=estimator)
        for estimator in ({"source": "given", "given": given, "scope": scope} for scope in ("team", "own"))
    )
    np.testing.assert_allclose(best(both, 5.0, 0.0).point, [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(best(one, 5.0, 0.0).point, [2.0, 0.0], atol=1e-12)


def test_boxes_that_move_do_not_count():
    moving = {"size": (0.4, 0.4), "waypoints": ({"time": 0.0, "center": (2.0, 0.0)},)}
    plan = scenario(plant="physics", world={"moving_boxes": (moving,)}, estimator={})
    np.testing.assert_array_equal(best(plan, 2.0, 0.0).point, [2.0, 0.0])
    assert distance_to_obstacles(plan, np.array([[2.0, 0.0]])) == np.inf


def test_too_many_ways_are_not_tried():
    boxes = tuple({"center": (2.0 + k, 2.0 + k), "size": (0.5, 0.5)} for k in range(13))
    found = best(around(boxes=boxes), 20.0, 20.0)
    assert found.point is None
    assert "4096 ways" in found.reason


def test_corners_of_many_rows_are_those_of_pair_after_pair_found_in_one_call(monkeypatch):
    """A world of twenty boxes has up to 4096 choices of faces, each with 190 pairs of rows."""
    rng, solve, calls = np.random.default_rng(20), np.linalg.solve, []
    C = rng.normal(size=(20, 2))
    C[7] = C[3]  # parallel
    C /= np.linalg.norm(C, axis=1)[:, None]
    d = rng.uniform(0.1, 2.0, 20)
    pairs = [list(pair) for pair in combinations(range(20), 2) if pair != (3, 7)]
    one_by_one = [solve(C[pair], d[pair]) for pair in pairs]
    monkeypatch.setattr(np.linalg, "solve", lambda *given: calls.append(1) or solve(*given))
    np.testing.assert_array_equal(_corners(C, d), one_by_one)
    assert len(calls) == 1
