import numpy as np
import pytest

from pbrg_mj.analysis.target import CLEARANCE, nearest, target, true_half_spaces
from tests.runs import FORMATION, WALL, scenario, walled


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
    np.testing.assert_array_equal(target(plan, np.array([7.0, 8.0])), [7.0, 8.0])


def test_the_foremost_robot_binds_the_formation():
    """b = ((0, 0), (1, 0)): the second robot reaches x <= 2 when the reference point is at x = 1."""
    plan = scenario(team={"start": FORMATION, "formation": ((0.0, 0.0), (1.0, 0.0)), "leaders": (1,)})
    np.testing.assert_allclose(target(plan, np.array([5.0, 3.0])), [1.0, 3.0], atol=1e-12)


def test_a_given_normal_may_have_any_length():
    plan = scenario(estimator={"source": "given", "given": ({"robot": 1, "normal": (3.0, 4.0), "offset": 10.0},)})
    G, h = true_half_spaces(plan)
    np.testing.assert_allclose(G, [[0.6, 0.8]])
    np.testing.assert_allclose(h, [2.0])


def test_the_wall_s_face_that_looks_at_the_team_moved_inward():
    G, h = true_half_spaces(walled(), clearance=0.15)
    np.testing.assert_allclose(G, [[1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(h, [2.2 - 0.15])
    np.testing.assert_allclose(target(walled(), np.array([5.0, 1.0])), [2.2 - CLEARANCE, 1.0], atol=1e-12)


@pytest.mark.parametrize(
    ("start", "normal", "offset"),
    [((9.0, 0.0), (-1.0, 0.0), -2.3), ((2.25, 8.0), (0.0, -1.0), -5.0), ((2.25, -8.0), (0.0, 1.0), -5.0)],
)
def test_a_wall_from_its_other_sides(start, normal, offset):
    team = {"start": (start,), "formation": ((0.0, 0.0),), "leaders": (1,)}
    G, h = true_half_spaces(walled(team=team), clearance=0.0)
    np.testing.assert_allclose(G, [normal], atol=1e-12)
    np.testing.assert_allclose(h, [offset], atol=1e-12)


def test_turning_the_wall_round_changes_nothing():
    turned = {"from": WALL["to"], "to": WALL["from"], "thickness": 0.1}
    for one, other in zip(
        true_half_spaces(walled()), true_half_spaces(scenario(world={"walls": (turned,)}, estimator={})), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-12)
