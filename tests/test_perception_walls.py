"""What a scan shows: walls, where they end, and nothing that is none."""

import numpy as np
import pytest

from pbrg_mj.perception.scan.extract_lines import Lines, extract_lines, line_buffer, line_workspace, write_lines
from tests.raycast import Scene, cast
from tests.scans import SENSORS, Sensor, four_robots, planted, sensor

DEFAULT = sensor()
WALL = Scene(((1.0, -3.0, 1.0, 3.0),))
CORNER = Scene(((1.0, -3.0, 1.0, 1.2), (1.0, 1.2, -3.0, 1.2)))
ROOM = Scene(((-2, -1.5, 2, -1.5), (2, -1.5, 2, 1.5), (2, 1.5, -2, 1.5), (-2, 1.5, -2, -1.5)))
TEAM = ((0.5, 0.1, 0.06), (0.7, -0.4, 0.06), (-0.4, 0.1, 0.06), (-0.1, 0.3, 0.06))


def walls(scene: Scene, pose: tuple[float, float, float] = (0, 0, 0), of: Sensor = DEFAULT) -> Lines:
    return extract_lines(of.look(scene, np.array(pose), None), of.directions, of.params)


def noisy(scene: Scene, random: np.random.Generator, of: Sensor = DEFAULT) -> Lines:
    pose = np.array([*random.uniform(-0.15, 0.15, 2), random.uniform(-3, 3)])
    return extract_lines(of.look(scene, pose, random), of.directions, of.params)


@pytest.mark.parametrize("heading", np.linspace(0, 2 * np.pi, 25))
def test_a_wall_is_found_wherever_the_scan_begins(heading: float) -> None:
    found = walls(WALL, (0, 0, heading))
    assert np.cos(found.angle + heading) == pytest.approx([1], abs=1e-9)
    assert found.offset == pytest.approx([1], abs=1e-9)
    assert found.high[0] - found.low[0] > 4.5  # all beams within 67 degrees of the normal


@pytest.mark.parametrize("heading", np.linspace(0, 2 * np.pi, 13))
def test_a_closed_room_has_four_walls(heading: float) -> None:
    found = walls(ROOM, (0.3, 0.2, heading))
    assert sorted(found.offset) == pytest.approx([1.3, 1.7, 1.7, 2.3], abs=1e-9)
    assert np.all(np.diff(found.high - found.low) <= 0)  # longest first
    assert not found.free_low.any() and not found.free_high.any()


def test_a_concave_corner_has_two_walls() -> None:
    found = walls(CORNER)
    order = np.argsort(found.offset)
    # Not exact: a point of one wall within the noise of the other may be counted with that one.
    assert found.offset[order] == pytest.approx([1, 1.2], abs=1e-3)
    assert found.angle[order] == pytest.approx([0, np.pi / 2], abs=1e-3)


@pytest.mark.parametrize("preset", ["generic", "robotarium", "lidar"])
def test_turning_the_scan_by_whole_beams_turns_the_lines(preset: str) -> None:
    random, of = np.random.default_rng(7), sensor(preset)
    for _ in range(40):
        ranges = of.look(Scene(CORNER.segments, four_robots(random)), np.zeros(3), random)
        shift = int(random.integers(1, len(ranges)))
        still = extract_lines(ranges, of.directions, of.params)
        turned = extract_lines(np.roll(ranges, shift), of.directions, of.params)
        turn = turned.angle - still.angle - 2 * np.pi * shift / len(ranges)
        assert len(still) > 0 and np.cos(turn) == pytest.approx(np.ones(len(still)), abs=1e-12)
        for name in ("offset", "covariance", "low", "high"):
            assert getattr(turned, name) == pytest.approx(getattr(still, name), rel=1e-7, abs=1e-9)
        assert np.array_equal(turned.free_low, still.free_low) and np.array_equal(turned.free_high, still.free_high)


@pytest.mark.parametrize("value", [np.nan, 0.3, 0.5, 0.75, 1.0, 2.0, 3.9])
@pytest.mark.parametrize("beams", [24, 36, 72, 180, 360])
def test_all_beams_equal_or_missing_is_no_wall(value: float, beams: int) -> None:
    of = sensor(count=beams)
    assert len(extract_lines(np.full(beams, value), of.directions, of.params)) == 0


@pytest.mark.parametrize("hits", [(), (3,), (3, 4), (71, 0), (3, 40), (70, 71, 0)])
def test_few_hits_are_no_wall(hits: tuple[int, ...]) -> None:
    ranges = np.full(72, np.nan)
    ranges[list(hits)] = 1.0
    assert len(extract_lines(ranges, DEFAULT.directions, DEFAULT.params)) == 0


@pytest.mark.parametrize("beams", [1, 2, 3, 5, 16])
def test_anything_may_be_in_a_scan(beams: int) -> None:
    random, of = np.random.default_rng(2), sensor(count=beams)
    for _ in range(50):
        ranges = random.choice([np.nan, np.inf, 0.0, 1.0, *random.uniform(0.1, 3.9, 4)], beams)
        assert len(extract_lines(ranges, of.directions, of.params)) <= beams // of.params.min_points


def test_the_kernel_writes_what_the_function_returns() -> None:
    ranges = DEFAULT.look(CORNER, np.zeros(3), np.random.default_rng(4))
    work, out = line_workspace(72), line_buffer(72)
    write_lines(np.full(72, 1.0), DEFAULT.directions, DEFAULT.params, work, out)  # leaves its traces
    count = write_lines(ranges, DEFAULT.directions, DEFAULT.params, work, out)
    lines = extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert count == len(lines) == 2
    for name in ("angle", "offset", "covariance", "low", "high", "free_low", "free_high"):
        assert np.array_equal(getattr(out, name)[:count], getattr(lines, name))


@pytest.mark.parametrize("preset", SENSORS)
def test_four_robots_are_no_walls(preset: str) -> None:
    random, of = np.random.default_rng(1), sensor(preset)
    work, out = line_workspace(of.beams.count), line_buffer(of.beams.count)
    for _ in range(10_000):
        ranges = of.look(Scene((), four_robots(random)), np.zeros(3), random)
        assert write_lines(ranges, of.directions, of.params, work, out) == 0


RECALL = {"generic": 0.985, "ideal": 0.985, "robotarium": 0.97, "tof_ring": 0.95, "lidar": 0.985}
RECALL |= {"tof_cones": 0.68, "lds_02": 0.97}  # robots hide more of the wall from cones


@pytest.mark.parametrize("preset", SENSORS)
def test_a_wall_with_robots_before_it_is_one_wall_where_it_is(preset: str) -> None:
    random, of, found = np.random.default_rng(2), sensor(preset), []
    for _ in range(400):
        angle, offset = random.uniform(-3, 3), random.uniform(0.4, 1.3)
        robots = tuple(
            (x, y, r) for x, y, r in four_robots(random) if x * np.cos(angle) + y * np.sin(angle) < offset - 0.2
        )
        wall = planted(angle, offset, -2.0, 2.0)
        ranges = of.look(Scene(wall.segments, robots), np.zeros(3), random)
        lines = extract_lines(ranges, of.directions, of.params)
        assert len(lines) <= 2
        if len(lines) > 0:
            error = np.array(
                [np.remainder(lines.angle[0] - angle + np.pi, 2 * np.pi) - np.pi, lines.offset[0] - offset]
            )
            assert error @ np.linalg.solve(lines.covariance[0], error) < 30
        found.append(len(lines))
    assert np.mean(np.array(found) == 1) > RECALL[preset]


@pytest.mark.parametrize(("scene", "count"), [(WALL, 1), (CORNER, 2), (ROOM, 4)])
@pytest.mark.parametrize("dropout", [0.0, 0.2])
def test_noise_and_dropout_rarely_hide_a_wall(scene: Scene, count: int, dropout: float) -> None:
    random, of = np.random.default_rng(3), sensor(dropout=dropout)
    found = [len(noisy(scene, random, of)) for _ in range(200)]
    assert max(found) <= count + (dropout > 0)  # five lost beams in a row are taken for a gap
    assert np.mean(found) > 0.98 * count


@pytest.mark.parametrize("off", [-0.6, -0.2, -0.06, 0.025, 0.06, 0.2, 1.0])
def test_lone_outliers_neither_split_nor_bend_a_wall(off: float) -> None:
    clean = cast(WALL, np.zeros(3), 72)
    ranges = clean.copy()
    ranges[[3, 67]] += off
    (expected,), found = walls(WALL).covariance, extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert found.offset == pytest.approx([1], abs=1e-9) and found.angle == pytest.approx([0], abs=1e-9)
    assert found.high - found.low == pytest.approx(walls(WALL).high - walls(WALL).low, abs=1e-9)
    assert np.all(np.diag(found.covariance[0]) < 1.3 * np.diag(expected))


@pytest.mark.parametrize("off", [-0.5, -0.1, 0.1, 0.5])
def test_a_lone_outlier_does_not_make_a_wall_too_short(off: float) -> None:
    ranges = cast(Scene(((1.0, -0.4, 1.0, 0.4),)), np.zeros(3), 72)
    ranges[0] += off
    found = extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert found.offset == pytest.approx([1], abs=1e-9) and found.high - found.low > 0.7


@pytest.mark.parametrize("there", [(2.5, 2.5), (np.nan, 2.5), (2.5, np.nan), (np.nan, np.nan)])
def test_two_beams_that_pass_part_a_wall(there: tuple[float, float]) -> None:
    ranges = cast(WALL, np.zeros(3), 72)
    ranges[[3, 4]] = there
    found = extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert found.offset == pytest.approx([1, 1], abs=1e-9)
    left, right = np.argsort(found.low)
    assert found.free_high[left] and found.free_low[right]


def test_a_thin_thing_before_a_wall_hides_two_beams_of_it_only() -> None:
    ranges = cast(WALL, np.zeros(3), 72)
    ranges[[3, 4]] = 0.7
    found = extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert len(found) == 1 and found.offset == pytest.approx([1], abs=1e-9)


def test_short_things_are_no_walls() -> None:
    assert len(walls(Scene(((0.4, -0.12, 0.4, 0.12),)))) == 0
    assert len(walls(Scene(((0.4, -0.16, 0.4, 0.16),)))) == 1


def test_a_short_thing_seen_obliquely_may_be_a_row_of_robots() -> None:
    assert len(walls(Scene(((0.3, 0.28, 0.3, 0.75),)))) == 0
    assert len(walls(Scene(((0.3, -0.05, 0.3, 0.4),)))) == 1
    assert len(walls(Scene(((0.3, 0.3, 0.3, 1.2),)))) == 1  # long enough


@pytest.mark.parametrize("beams", [72, 360])
@pytest.mark.parametrize("radius", [0.06, 0.3, 0.5, 0.65])
def test_a_pillar_is_no_wall(radius: float, beams: int) -> None:
    for distance in (0.2, 0.4, 0.7, 1.0):
        assert len(walls(Scene((), ((radius + distance, 0.0, radius),)), of=sensor(count=beams))) == 0


def test_a_rough_surface_is_no_wall() -> None:
    ranges = cast(Scene(((0.8, -0.5, 0.8, 0.5),)), np.zeros(3), 72)
    assert len(extract_lines(ranges, DEFAULT.directions, DEFAULT.params)) == 1
    rough = ranges + 0.012 * (-1.0) ** np.arange(72)  # no single point is an outlier, all together are
    assert len(extract_lines(rough, DEFAULT.directions, DEFAULT.params)) == 0


def ends(scene: Scene, of: Sensor = DEFAULT) -> list[tuple[bool, bool]]:
    found = walls(scene, of=of)
    return [(bool(low), bool(high)) for low, high in zip(found.free_low, found.free_high, strict=True)]


@pytest.mark.parametrize("behind", [(), ((2.5, -3.0, 2.5, 3.0),)])
def test_a_wall_ends_where_beams_pass(behind: tuple[tuple[float, float, float, float], ...]) -> None:
    both = Scene(((1.0, -0.7, 1.0, 0.7), *behind))
    assert (True, True) in ends(both)
    assert (False, True) in ends(Scene(((1.0, -6.0, 1.0, 0.7), *behind)))  # the one end is out of range
    assert ends(Scene(((1.0, -6.0, 1.0, 6.0), *behind)))[0] == (False, False)


def test_an_end_that_is_hidden_or_lost_is_none() -> None:
    half = ((1.0, -6.0, 1.0, 0.7),)
    assert ends(Scene(half)) == [(False, True)]
    assert ends(Scene(half, ((0.4, 0.4, 0.06),))) == [(False, False)]  # a robot before the end
    ranges = cast(Scene(((1.0, -6.0, 1.0, 6.0),)), np.zeros(3), 72)
    ranges[9:] = np.where(np.arange(9, 72) < 30, 0.5, ranges[9:])  # something near hides the rest
    ranges[8] = np.nan  # and one beam is lost
    found = extract_lines(ranges, DEFAULT.directions, DEFAULT.params)
    assert not found.free_high[np.argmin(np.abs(found.offset - 1))]


def test_corners_are_ends_only_where_beams_pass() -> None:
    assert [high for _, high in ends(CORNER)] == [False, False]
    assert [low for low, _ in ends(CORNER)] == [False, False]  # concave: the other wall hides what would follow
    box = walls(Scene(((0.6, -0.5, 0.6, 0.3), (0.6, 0.3, 1.8, 0.3))), (0.0, 1.2, 0.0))
    near = np.argmax(np.abs(box.offset - 0.9) < 1e-2)
    assert box.free_high[near] or box.free_low[near]  # convex: beams pass the face


@pytest.mark.parametrize("preset", ["generic", "ideal", "lidar"])
def test_a_doorway_parts_a_wall_and_a_robot_before_it_does_not(preset: str) -> None:
    of = sensor(preset)
    door = Scene(((1.0, -1.5, 1.0, -0.25), (1.0, 0.3, 1.0, 1.5)))
    found = walls(door, of=of)
    assert found.offset == pytest.approx([1, 1], abs=1e-9)
    left, right = np.argsort(found.low)
    assert found.free_high[left] and found.free_low[right]
    robots = ((0.4, 0.0, 0.06), (0.35, 0.15, 0.06), (0.35, -0.15, 0.06))
    (offset,) = walls(Scene(WALL.segments, robots), of=of).offset
    assert offset == pytest.approx(1, abs=1e-9)


def test_a_crack_parts_nothing() -> None:
    found = walls(Scene(((1.0, -1.5, 1.0, -0.03), (1.0, 0.03, 1.0, 1.5))), of=sensor("lidar"))
    assert len(found) == 1 and found.high[0] - found.low[0] > 2.8


@pytest.mark.parametrize("step", [0.1, 0.3])
def test_a_step_is_two_walls(step: float) -> None:
    stepped = Scene(((1.0, -1.5, 1.0, 0.1), (1.0 + step, 0.1, 1.0 + step, 1.5)))
    assert sorted(walls(stepped).offset) == pytest.approx([1, 1 + step], abs=1e-3)


def test_a_direction_that_noise_hides_is_none() -> None:
    short = Scene(((0.5, -0.14, 0.5, 0.14),))
    assert len(walls(short)) == 1 and len(walls(short, of=sensor("robotarium"))) == 0


def test_a_wall_near_the_range_limit_is_not_pulled_in() -> None:
    random, of = np.random.default_rng(11), sensor("robotarium", dropout=0.0, outliers=0.0)
    scene = planted(0.0, 3.2, -6.0, 6.0)
    found = [extract_lines(of.look(scene, np.zeros(3), random), of.directions, of.params) for _ in range(1500)]
    offsets = np.array([lines.offset[0] for lines in found if len(lines) > 0])
    assert len(offsets) > 1400  # so much noise may hide a kink: one of twenty is not straight enough
    assert abs(offsets.mean() - 3.2) < 0.003  # one scan scatters by 0.028


def test_the_ends_of_a_sweep_are_no_ends_of_walls() -> None:
    angle = np.deg2rad(np.linspace(-60, 60, 49))
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    found = extract_lines(1.0 / np.cos(angle), directions, DEFAULT.params._replace(closed=False))
    assert found.offset == pytest.approx([1], abs=1e-9)
    assert not found.free_low[0] and not found.free_high[0]
    half = np.where(angle < 0.5, 1.0 / np.cos(angle), np.nan)
    found = extract_lines(half, directions, DEFAULT.params._replace(closed=False))
    assert not found.free_low[0] and found.free_high[0]
