"""Which of many places is nearest to a path, and which a half-space leaves, against plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.face import points_not_separated
from pbrg_mj.perception.points.lines import line_at, no_lines
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.obstacle_points import ObstaclePoints, empty_points, measure_from, nearest_point
from tests.seeing_points import estimator

NO_LINE = line_at(no_lines(1), 0)
COUNTS = [0, 1, 15, 16, 17, 33, 200]


def random_places(rng: np.random.Generator, count: int) -> ObstaclePoints:
    """Return places of the edge of what is known to be free, which have no echo."""
    places = empty_points(count, no_points(1, 0)[0])
    places.x[:], places.y[:] = rng.normal(size=(2, count))
    places.std[:], places.inset[:], places.point[:] = rng.uniform(0.0, 0.02, count), rng.uniform(0.1, 0.3, count), -1
    return places


@pytest.mark.parametrize("count", COUNTS)
def test_the_nearest_place_is_the_first_of_the_least_distance_that_is_not_zero(count: int):
    rng = np.random.default_rng(331)
    for _ in range(20):
        places, (x, y) = random_places(rng, count), rng.normal(size=2)
        path = (x, y, x, y)
        if count > 2:
            places.x[count // 3], places.y[count // 3] = x, y  # on the path
            again, once = rng.permutation(count)[:2]  # twice the same place
            places.x[again], places.y[again] = places.x[once], places.y[once]
        measure_from(path, places, count)
        distances = np.hypot(places.x - x, places.y - y)
        nearest, distance, dx, dy = nearest_point(places, count, path)
        if count == 0:
            assert nearest == -1
            continue
        distances[distances == 0.0] = np.inf
        assert nearest == np.argmin(distances)
        assert distance == pytest.approx(distances.min(), rel=1e-12)
        assert (dx, dy) == pytest.approx(((places.x[nearest] - x) / distance, (places.y[nearest] - y) / distance))


@pytest.mark.parametrize("count", COUNTS)
def test_what_a_half_space_leaves_comes_first_and_in_order_and_no_place_is_lost(count: int):
    parameters, rng = estimator()[0].parameters, np.random.default_rng(332)
    for _ in range(20):
        places, turn = random_places(rng, count), rng.uniform(0.0, 2.0 * np.pi)
        normal, nearest = (np.cos(turn), np.sin(turn)), rng.normal()
        h = nearest - rng.uniform(-0.02, 0.1)
        before = np.column_stack([places.x, places.y, places.std, places.inset])
        along = normal[0] * places.x + normal[1] * places.y
        left = along - places.inset < np.minimum(nearest, h + parameters.sigmas * places.std)
        assert points_not_separated(places, count, ((normal, nearest, h), NO_LINE), parameters) == left.sum()
        after = np.column_stack([places.x, places.y, places.std, places.inset])
        np.testing.assert_array_equal(after[: left.sum()], before[left])
        np.testing.assert_array_equal(np.sort(after, axis=0), np.sort(before, axis=0))
