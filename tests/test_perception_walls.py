"""What a scan shows: walls, and nothing that is none."""

import numpy as np
import pytest

from pbrg_mj.perception.clusters import cluster
from pbrg_mj.perception.lines import Line
from pbrg_mj.perception.points import scan_points
from pbrg_mj.perception.segments import split_and_merge
from pbrg_mj.perception.setup import SegmentRules, beam_directions
from pbrg_mj.perception.walls import find_walls
from tests.raycast import Scene, cast

RULES = SegmentRules(range_std=0.005, split_distance=0.03, min_points=5, min_length=0.25)
BEAMS = 72
WALL = Scene(((1.0, -3.0, 1.0, 3.0),))
CORNER = Scene(((1.0, -3.0, 1.0, 1.2), (1.0, 1.2, -3.0, 1.2)))
ROOM = Scene(((-2, -1.5, 2, -1.5), (2, -1.5, 2, 1.5), (2, 1.5, -2, 1.5), (-2, 1.5, -2, -1.5)))
TEAM = ((0.5, 0.1, 0.06), (0.7, -0.4, 0.06), (-0.4, 0.1, 0.06), (-0.1, 0.3, 0.06))


def walls(scene: Scene, pose: tuple[float, float, float] = (0, 0, 0), beams: int = BEAMS) -> list[Line]:
    return find_walls(cast(scene, np.array(pose), beams), beam_directions(beams), RULES)


def noisy(scene: Scene, random: np.random.Generator, dropout: float = 0.0) -> list[Line]:
    pose = np.array([*random.uniform(-0.15, 0.15, 2), random.uniform(-3, 3)])
    ranges = cast(scene, pose, BEAMS) + RULES.range_std * random.standard_normal(BEAMS)
    ranges[random.random(BEAMS) < dropout] = np.nan
    return find_walls(ranges, beam_directions(BEAMS), RULES)


@pytest.mark.parametrize("heading", np.linspace(0, 2 * np.pi, 25))
def test_a_wall_is_found_wherever_the_scan_begins(heading: float) -> None:
    (line,) = walls(WALL, (0, 0, heading))
    assert np.cos(line.angle + heading) == pytest.approx(1, abs=1e-9)
    assert line.offset == pytest.approx(1, abs=1e-9)
    assert len(line.along) >= 27  # beams within 70 degrees of the normal, all of them


@pytest.mark.parametrize("heading", np.linspace(0, 2 * np.pi, 13))
def test_a_closed_room_has_four_walls(heading: float) -> None:
    found = walls(ROOM, (0.3, 0.2, heading))
    assert sorted(line.offset for line in found) == pytest.approx([1.3, 1.7, 1.7, 2.3], abs=1e-9)


def test_a_concave_corner_has_two_walls() -> None:
    found = sorted(walls(CORNER), key=lambda line: line.offset)
    # Not exact: a point of one wall within the noise of the other may be counted with that one.
    assert [line.offset for line in found] == pytest.approx([1, 1.2], abs=1e-3)
    assert [line.angle for line in found] == pytest.approx([0, np.pi / 2], abs=1e-3)


@pytest.mark.parametrize("value", [0.3, 0.5, 0.75, 1.0, 2.0, 3.9])
@pytest.mark.parametrize("beams", [36, 72, 180, 360])
def test_all_beams_equal_is_no_wall(value: float, beams: int) -> None:
    assert find_walls(np.full(beams, value), beam_directions(beams), RULES) == []


@pytest.mark.parametrize("hits", [(), (3,), (3, 4), (71, 0), (3, 40), (70, 71, 0)])
def test_few_hits_are_no_wall(hits: tuple[int, ...]) -> None:
    ranges = np.full(BEAMS, np.nan)
    ranges[list(hits)] = 1.0
    assert find_walls(ranges, beam_directions(BEAMS), RULES) == []


@pytest.mark.parametrize("beams", [1, 2, 3, 5, 16])
def test_very_few_beams_do_not_raise(beams: int) -> None:
    for seed in range(20):
        ranges = np.random.default_rng(seed).uniform(0.1, 3.9, beams)
        assert len(find_walls(ranges, beam_directions(beams), RULES)) <= beams // RULES.min_points


def test_robots_in_front_of_nothing_are_no_walls() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        places = random.uniform(-1.5, 1.5, (4, 2))
        discs = tuple((float(x), float(y), 0.06) for x, y in places if np.hypot(x, y) > 0.35)
        assert noisy(Scene((), discs), random) == []


def test_a_robot_before_a_wall_leaves_one_wall() -> None:
    random = np.random.default_rng(2)
    for _ in range(100):
        (line,) = noisy(Scene(WALL.segments, TEAM), random)
        assert np.ptp(line.along) > 2  # both sides of the robots


def test_collinear_pieces_are_one_wall() -> None:
    apart = Scene(((1.0, -1.5, 1.0, -0.3), (1.0, 0.4, 1.0, 1.5)))
    (line,) = walls(apart)
    assert line.offset == pytest.approx(1, abs=1e-9) and np.ptp(line.along) > 2
    stepped = Scene(((1.0, -1.5, 1.0, -0.3), (1.3, 0.4, 1.3, 1.5)))
    assert sorted(line.offset for line in walls(stepped)) == pytest.approx([1, 1.3], abs=1e-9)


@pytest.mark.parametrize(("scene", "count"), [(WALL, 1), (CORNER, 2), (ROOM, 4)])
@pytest.mark.parametrize("dropout", [0.0, 0.2])
def test_noise_and_dropout_rarely_hide_a_wall(scene: Scene, count: int, dropout: float) -> None:
    random = np.random.default_rng(3)
    found = [len(noisy(scene, random, dropout)) for _ in range(200)]
    assert max(found) == count  # and never one too many
    assert np.mean(found) > 0.985 * count


def test_short_things_are_no_walls() -> None:
    assert walls(Scene(((0.4, -0.12, 0.4, 0.12),))) == []
    assert len(walls(Scene(((0.4, -0.16, 0.4, 0.16),)))) == 1


def test_one_missing_beam_does_not_cut_a_cluster() -> None:
    ranges = cast(WALL, np.zeros(3), BEAMS)
    ranges[[2, 69]] = np.nan
    _, clusters, ring = cluster(scan_points(ranges, beam_directions(BEAMS)), RULES.range_std)
    assert len(clusters) == 1 and not ring


def test_clusters_follow_one_another_round_the_circle() -> None:
    ranges = cast(Scene(((1.0, -0.5, 1.0, 0.5), (-1.0, -0.5, -1.0, 0.5))), np.zeros(3), BEAMS)
    points, clusters, ring = cluster(scan_points(ranges, beam_directions(BEAMS)), RULES.range_std)
    assert [stop - start for start, stop in clusters] == [11, 11] and not ring
    for start, stop in clusters:
        assert np.all(np.diff(points.beam[start:stop]) % BEAMS == 1)


def test_pieces_cover_their_clusters_and_are_straight() -> None:
    random = np.random.default_rng(4)
    for _ in range(50):
        ranges = random.uniform(0.5, 3.5, BEAMS)
        points, clusters, _ = cluster(scan_points(ranges, beam_directions(BEAMS)), RULES.range_std)
        pieces = split_and_merge(points.xy_body, clusters, 0.03)
        assert [low for low, _ in pieces][1:] == [high for _, high in pieces][:-1]
        assert pieces[0][0] == 0 and pieces[-1][1] == BEAMS
        for low, high in pieces:
            a, chord = points.xy_body[low], points.xy_body[high - 1] - points.xy_body[low]
            off = (points.xy_body[low:high] - a) @ np.array([-chord[1], chord[0]])
            assert np.all(np.abs(off) <= 0.03 * np.hypot(*chord) + 1e-12)


@pytest.mark.parametrize("beams", [72, 360])
@pytest.mark.parametrize("radius", [0.06, 0.3, 0.5, 0.65])
def test_a_pillar_is_no_wall(radius: float, beams: int) -> None:
    for distance in (0.2, 0.4, 0.7, 1.0):
        assert walls(Scene((), ((radius + distance, 0.0, radius),)), beams=beams) == []


def test_a_rough_surface_is_no_wall() -> None:
    ranges = cast(Scene(((0.8, -0.5, 0.8, 0.5),)), np.zeros(3), BEAMS)
    assert len(find_walls(ranges, beam_directions(BEAMS), RULES)) == 1
    rough = ranges + 0.012 * (-1.0) ** np.arange(BEAMS)  # no single point is an outlier, all together are
    assert find_walls(rough, beam_directions(BEAMS), RULES) == []


def test_a_step_in_depth_parts_clusters() -> None:
    stepped = cast(Scene(((1.0, -0.5, 1.0, 0.05), (2.5, -0.5, 2.5, 1.0))), np.zeros(3), BEAMS)
    points, clusters, _ = cluster(scan_points(stepped, beam_directions(BEAMS)), RULES.range_std)
    assert len(clusters) == 2
    assert [np.ptp(points.xy_body[slice(*piece), 0]) for piece in clusters] == pytest.approx([0, 0], abs=1e-9)


def test_a_ring_is_cut_at_its_farthest_corner() -> None:
    ranges = cast(ROOM, np.array([0.3, 0.2, 0.0]), BEAMS)
    points, clusters, ring = cluster(scan_points(ranges, beam_directions(BEAMS)), RULES.range_std)
    assert ring and clusters == [(0, BEAMS)]
    assert points.range[0] == ranges.max()


def test_a_corner_is_split_and_what_is_straight_together_is_merged() -> None:
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [3.0, 2.0]])
    assert split_and_merge(corner, [(0, 6)], 0.03) == [(0, 3), (3, 6)]
    # The first cut puts the last point of the one wall with the next; merging gives it back.
    wide = np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3.5, 0.6], [3.5, 1.6], [3.5, 2.6], [3.5, 3.6]])
    assert split_and_merge(wide, [(0, 8)], 0.03) == [(0, 4), (4, 8)]
