import numpy as np
import pytest

from pbrg_mj.scenario.schema import Wall
from pbrg_mj.world.scene.footprints import footprints_of, signed_distance, wall_margin


def random_walls(rng: np.random.Generator, count: int) -> list[Wall]:
    ends = rng.uniform(-2, 2, (count, 2, 2))
    return [
        Wall.model_validate({"from": tuple(a), "to": tuple(b), "thickness": rng.uniform(0.05, 0.5)}) for a, b in ends
    ]


def outline(wall: Wall, spacing: float = 2e-4) -> tuple[np.ndarray, np.ndarray]:
    """Return points along the wall's four faces, and its corners in order."""
    a, b = np.array(wall.start), np.array(wall.end)
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a) * wall.thickness / 2
    corners = np.array([a - normal, b - normal, b + normal, a + normal])
    faces = [
        p + np.linspace(0, 1, int(np.linalg.norm(q - p) / spacing) + 2)[:, None] * (q - p)
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    return np.vstack(faces), corners


def inside(point: np.ndarray, corners: np.ndarray) -> bool:
    edges = np.roll(corners, -1, axis=0) - corners
    to = point - corners
    return bool(np.all(edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0] > 0))


def test_signed_distance_agrees_with_the_nearest_of_many_points_on_the_faces():
    rng = np.random.default_rng(5)
    walls = random_walls(rng, 6)
    points = np.vstack([rng.uniform(-3, 3, (40, 2)), [np.add(w.start, w.end) / 2 + 0.01 for w in walls]])
    got = signed_distance(points, footprints_of(walls))
    within = 0
    for k, w in enumerate(walls):
        faces, corners = outline(w)
        for i, point in enumerate(points):
            nearest = np.linalg.norm(faces - point, axis=1).min()
            sign = -1 if inside(point, corners) else 1
            within += sign < 0
            assert got[i, k] == pytest.approx(sign * nearest, abs=2e-4)
    assert within >= 6


def test_faces_corners_and_middle_of_a_wall():
    walls = footprints_of([Wall.model_validate({"from": (0, 0), "to": (2, 0), "thickness": 0.2})])
    points = np.array([[1, 0.4], [1, -0.4], [2.5, 0], [2.3, 0.5], [1, 0], [0.01, 0]])
    np.testing.assert_allclose(signed_distance(points, walls)[:, 0], [0.3, 0.3, 0.5, 0.5, -0.1, -0.01], atol=1e-15)


def test_margin_is_infinite_without_walls_and_least_with_several():
    points = np.array([[0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_array_equal(wall_margin(points, footprints_of([]), 0.1), [np.inf, np.inf])
    walls = [Wall.model_validate({"from": (x, -1), "to": (x, 1), "thickness": 0.2}) for x in (2.0, -1.0)]
    np.testing.assert_allclose(wall_margin(points, footprints_of(walls), 0.1), [0.8, 0.8], atol=1e-15)
