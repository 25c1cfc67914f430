"""Closing speeds of faces: what comes nearer is known to, and what stands still is not taken to move."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE, scans_by_age, store_scan
from pbrg_mj.perception.points.range_flow import LEFT, RIGHT, free_ends, range_flow
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import box, together
from tests.raycast import Scene, cast
from tests.seeing_points import ROBOT, estimator, scan, sensor

SENSORS = ["default", "lidar", "tof_ring", "robotarium"]
TARGET = np.array([[3.0, 0.0]])


def seen(preset: str, seed: int, scenes: list[Scene], poses: np.ndarray):
    """Yield the half-spaces after each scan of a scene of its own, from poses (T, 3)."""
    made, given = estimator(sensor(preset))
    given, memory = given.model_copy(update={"seed": seed}), made.init()
    pictures = round(period(preset) * given.sensors.camera.rate_hz)  # of the camera, between scans
    for frame, (scene, pose) in enumerate(zip(scenes, poses, strict=True)):
        readings = scan(given, scene, pose[None], frame)._replace(pose_frame=pictures * frame)
        known, memory = made.step_towards(readings, frame * period(preset), memory, TARGET)
        assert known.closing is not None
        yield known


def period(preset: str) -> float:
    return 1.0 / estimator(sensor(preset))[1].sensors.beams.rate_hz


def times(preset: str, seconds: float) -> np.ndarray:
    return np.arange(0.0, seconds, period(preset))


def sideways(time: np.ndarray, speed: float) -> np.ndarray:
    return np.column_stack([np.zeros_like(time), speed * time, np.zeros_like(time)])


@pytest.mark.parametrize("preset", SENSORS)
@pytest.mark.parametrize("own", [0.0, 0.2])
def test_a_box_that_comes_nearer_is_as_fast_as_it_is(preset: str, own: float):
    """At 0.6 m, whatever the robot does across: a standard deviation is added, that of 24 beams is large."""
    (rng, time), errors = (np.random.default_rng(81), times(preset, 1.6)), []
    for seed in range(8):
        speed, turn = rng.uniform(0.15, 0.4), rng.uniform(-0.4, 0.4)
        scenes = [box(0.85 + speed * left, own * time[-1], 0.5, angle=turn) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, own))
        ahead = int(np.argmax(np.where(known.active[0], known.G[0, :, 0], -1.0)))
        assert known.closing is not None
        errors.append(known.closing[0, ahead] - speed * known.G[0, ahead, 0])
    assert 0.0 <= np.median(errors) < (0.12 if preset == "tof_ring" else 0.08)
    assert np.min(errors) > -0.05


@pytest.mark.parametrize("preset", SENSORS)
def test_what_stands_still_hardly_ever_seems_to_come(preset: str):
    """Robots that drive past walls, boxes, a corner and columns: under 2 % of half-spaces seem to move.

    With 24 beams 5 % do: a corner between two of them is nearer than the line that joins their echoes.
    """
    rng, moving, count = np.random.default_rng(82), 0, 0
    for seed in range(10):
        faces = box(1.2, 0.1, 0.4, angle=rng.uniform(0, 1.5)).segments + box(0.9, 1.2, 0.3, angle=1.0).segments
        wall = ((2.0, -3.0, 2.0, 3.0), (2.0, 3.0, -2.0, 3.0), (-1.0, -1.0, 1.0, -0.8))
        scene = Scene((*faces, *wall), ((0.5, -0.4, 0.1), (0.8, 0.8, 0.05)))
        time = times(preset, 3.0)
        poses = sideways(time, 0.25) - [0.0, 0.4, 0.0]
        poses[:, 2] = rng.uniform(-1, 1) * time
        for known in seen(preset, seed, [scene] * len(time), poses):
            moving, count = moving + np.count_nonzero(known.closing_speeds), count + np.count_nonzero(known.active)
    assert count > 500
    assert moving < (0.07 if preset == "tof_ring" else 0.02) * count


def test_a_long_face_beside_the_way_is_known_to_come_however_slanted():
    """`lidar` drives at 0.25 m/s and has seen all of it at more than 70 deg: in 4 of 8 it seemed to rest."""
    time = times("lidar", 1.2)
    ahead = np.column_stack([0.25 * (time - time[-1]), np.zeros_like(time), np.zeros_like(time)])
    for seed in range(8):
        speed = 0.1 + 0.02 * seed
        scenes = [box(0.8, 0.54 + speed * left, 0.8) for left in time[-1] - time]
        *_, known = seen("lidar", seed, scenes, ahead)
        beside = int(np.argmax(np.where(known.active[0], known.G[0, :, 1], -1.0)))
        come = speed * known.G[0, beside, 1]  # along the normal, which is that of its nearest place
        assert -0.01 < known.closing_speeds[0, beside] - come < 0.06


def test_half_spaces_of_what_comes_are_ahead_of_it_by_the_time_to_react():
    made, _ = estimator()
    speed, time = 0.3, times("default", 1.4)
    scenes = [box(0.9 + speed * left, 0.0, 0.5) for left in time[-1] - time]
    *_, known = seen("default", 3, scenes, sideways(time, 0.0))
    *_, still = seen("default", 3, [scenes[-1]] * len(time), sideways(time, 0.0))
    assert known.closing is not None
    now, resting = (int(np.argmax(one.G[0, :, 0])) for one in (known, still))
    ahead = made.parameters.reaction * known.closing[0, now]
    assert still.closing is not None and not still.closing_speeds.any()
    # Of a face that moves the nearest echo counts, of one at rest the line: 3 cm are its 5 mm of noise, and the pose's.
    assert -0.04 < known.h[0, now] - (still.h[0, resting] - ahead) < 0.0
    assert made.parameters.reaction > period("default") + ROBOT.time_constant


@pytest.mark.parametrize("preset", SENSORS)
def test_walls_beside_the_robot_do_not_tell_of_the_box_before_it(preset: str):
    """They lie just beyond the half-space of the box, too, nearer along its normal: it goes on for ever."""
    time, beside = times(preset, 1.6), Scene(((0.2, 2.2, 1.6, 2.2), (0.2, -2.2, 1.6, -2.2)))
    for seed in range(4):
        speed = 0.25 + 0.05 * seed
        scenes = [together(box(0.85 + speed * left, 0.0, 0.5), beside) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, 0.0))
        ahead = int(np.argmax(np.where(known.active[0], known.G[0, :, 0], -1.0)))
        assert known.closing is not None
        assert known.closing[0, ahead] > speed * known.G[0, ahead, 0] - 0.05


@pytest.mark.parametrize("preset", ["default", "lidar"])
def test_a_box_that_comes_behind_what_stands_is_known_to_come(preset: str):
    """Two boards stand 5 cm nearer along the same normal: a half-space that keeps off one keeps off all three."""
    time, boards = times(preset, 1.6), Scene(((0.5, -0.8, 0.5, -0.2), (0.5, 0.2, 0.5, 0.8)))
    for seed in range(6):
        scenes = [together(box(0.7 + 0.25 * left, 0.0, 0.3), boards) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, 0.0))
        assert known.closing_speeds[0, known.G[0, :, 0] > 0.9].max() > 0.15  # a board may have one of its own


@pytest.mark.parametrize("preset", [*SENSORS, "tof_cones", "lds_02"])
def test_every_sensor_has_a_scan_in_between_that_confirms_flows(preset: str):
    assert estimator(sensor(preset))[0].parameters.lag >= 2


@pytest.mark.parametrize("preset", ["default", "lidar"])
def test_what_another_half_space_keeps_off_does_not_tell_of_the_box(preset: str):
    """A wall beside the robot is nearer along the normal of the box's half-space than the clearance, or on it."""
    time, wall = times(preset, 1.6), Scene(((0.1, 0.17, 0.36, 0.17),))
    for seed in range(6):
        scenes = [together(box(0.55 + 0.25 * left, 0.0, 0.3), wall) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, 0.0))
        ahead = int(np.argmax(np.where(known.active[0], known.G[0, :, 0], -1.0)))
        assert known.closing_speeds[0, ahead] > 0.25 * known.G[0, ahead, 0] - 0.05


def scanned(made: PointEstimator, scene: Scene) -> np.ndarray:
    """The scan of a robot at the origin, without noise, as it is remembered."""
    ranges = cast(scene, np.zeros(3), len(made.parameters.directions), made.parameters.range_max)
    _, memory = made.step_towards(Readings(np.zeros((1, 3)), ranges[None], True, 0, 0), 0.0, made.init(), TARGET)
    return memory.past[0, int(np.argmax(memory.past_poses[0]["known"]))]


def nothing_before(beams: int) -> tuple[np.ndarray, np.ndarray]:
    """The scans before the first one, for `add_scan`."""
    return np.zeros((1, beams), PAST_ECHO), np.zeros(1, PAST_POSE)


def test_a_face_ends_where_beams_pass_by_and_not_where_it_is_slanted():
    scan = scanned(estimator()[0], together(box(0.9, 0.0, 0.4), Scene(((-3.0, -0.3, 3.0, -0.3),))))
    face = np.flatnonzero((scan["x"] > 0.69) & (np.abs(scan["y"]) < 0.21))
    face = face[np.argsort(scan["y"][face])]
    assert scan["ends"][face[0]] == RIGHT and scan["ends"][face[-1]] == LEFT
    assert not np.delete(scan["ends"], face[[0, -1]]).any()  # the wall is met at up to 80 deg


def test_the_flow_of_free_ends_is_the_speed_along_the_face():
    """A box slides past 0.5 m ahead: its near face has no flow along its normal. Unbiased, with the variance told."""
    made, elapsed, speed = estimator()[0].parameters, 0.3, 0.3
    beams, team = len(made.directions), (np.zeros((1, 1, 2)), 0)
    errors, told = [], []
    for shift in np.linspace(0.0, 0.2, 200):
        past, place = np.zeros(beams, PAST_ECHO), np.zeros(1, PAST_POSE)
        for time, y in ((0.0, shift), (elapsed, shift + speed * elapsed)):
            scan = SeenBeams(cast(box(0.75, y - 0.15, 0.5), np.zeros(3), beams, made.range_max), made.directions)
            pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, time, elapsed)
            echoes = add_scan(no_points(1, beams)[0], 1, scan, pose, team, nothing_before(beams), made)
            ends = free_ends(echoes, scan.ranges, pose, made)
            told_of, before = (ends, np.zeros(beams, bool)), (past[None], place, scans_by_age(place))
            flows, count = range_flow((echoes, scan.ranges), told_of, before, pose, made)
            store_scan(past, place, (echoes, scan), ends, pose)
        along = np.abs(flows.ny[:count]) > 0.7
        errors += list(flows.speed[:count][along] - flows.ny[:count][along] * speed)
        told += list(flows.variance[:count][along])
    assert len(errors) > 150
    assert abs(np.mean(errors)) < 0.02
    assert np.mean(np.square(errors)) == pytest.approx(np.mean(told), rel=0.5)


@pytest.mark.parametrize("preset", ["default", "lidar", "robotarium"])
def test_a_box_that_slides_along_its_face_is_not_told_to_stand(preset: str):
    """Noise turns the line of two echoes that are close together, by 30 deg where there are 360 beams."""
    (made, given), elapsed, speed = estimator(sensor(preset)), 0.25, 0.3
    numbers, squares = made.parameters, []
    beams, team = len(numbers.directions), (np.zeros((1, 1, 2)), 0)
    past, past_pose = np.zeros(beams, PAST_ECHO), np.zeros(1, PAST_POSE)
    for frame in range(120):
        y, time = -0.1 + speed * elapsed * (frame % 2), frame * elapsed
        ranges = scan(given, box(0.6, y, 0.4), np.zeros((1, 3)), frame).ranges[0]
        pose, read = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, time, elapsed), SeenBeams(ranges, numbers.directions)
        echoes = add_scan(no_points(1, beams)[0], 1, read, pose, team, nothing_before(beams), numbers)
        ends = free_ends(echoes, ranges, pose, numbers)
        before = past[None], past_pose, scans_by_age(past_pose)
        flows, count = range_flow((echoes, ranges), (ends, np.zeros(beams, bool)), before, pose, numbers)
        store_scan(past, past_pose, (echoes, read), ends, pose)
        if frame % 2:
            x, across, ny = flows.x[:count], flows.y[:count], flows.ny[:count]
            on_face = (np.abs(x - 0.4) < 0.05) & (np.abs(across) < 0.1) & (np.abs(ny) < 0.8)
            squares += list(((flows.speed[:count] - ny * speed) ** 2 / flows.variance[:count])[on_face])
    assert len(squares) > 40
    assert np.median(squares) < 1.0  # 0.45 of honest ones


def beside_the_way(preset: str, side: float, apart: float | None) -> tuple[float, float]:
    """Return the room to the half-space that faces a box beside the way [m], and the cosine to the box's nearest place.

    A track moves so far `apart` from the hand point [m], on its other side; None: none does.
    """
    (made, given), scene, pose = estimator(sensor(preset)), box(1.0, 0.55 * side, 0.5), np.zeros((1, 3))
    q, toward = np.array([ROBOT.hand_offset, 0.0]), np.array([0.75 - ROBOT.hand_offset, 0.3 * side])
    memory, known = made.init(), HalfSpaces.empty(1, made.slots)
    for frame in range(12):
        tracks, time = memory.tracks.copy(), frame * period(preset)
        if apart is not None and frame > 2:  # what moves has been seen before
            tracks[0, 0] = (q[0] - apart, q[1], 0.0, 0.0, 1e-4, 0.0, 1e-4, time, 0.0, True, True)
        readings = scan(given, scene, pose, frame)._replace(pose_frame=10 * frame)
        known, memory = made.step_towards(readings, time, memory._replace(tracks=tracks), TARGET)
    cosines = known.G[0] @ toward / np.linalg.norm(toward)
    k = int(np.argmax(np.where(known.active[0], cosines, -1.0)))
    return known.h[0, k] - known.G[0, k] @ q, cosines[k]


@pytest.mark.parametrize("preset", SENSORS)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_what_moves_half_spaces_are_made_for_where_the_robot_is(preset: str, side: float):
    """While a track moves within a metre, the half-space of a box beside the way to a target faces its nearest place.

    Else it leaves the way free, and so the robot 0.4 m less room.
    """
    room, cosine = beside_the_way(preset, side, None)
    near_room, near_cosine = beside_the_way(preset, side, 0.9)
    assert near_room > room + 0.4
    assert near_cosine > np.cos(np.radians(20.0)) > cosine
    assert beside_the_way(preset, side, 1.1)[0] == pytest.approx(room, abs=0.02)
