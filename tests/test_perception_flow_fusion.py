"""What flows tell of a face's velocity: all of a scan share the error of its poses, and others confirm them."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.face_track import TRACK, WALK_AT_REST
from pbrg_mj.perception.points.fuse_flows import LEAST_FLOWS, MANEUVER, fuse_flows, has_maneuvered
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.motion import UNSEEN, track_at
from pbrg_mj.perception.points.normal_flow import ANY_SPEED
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE, scans_by_age, store_scan
from pbrg_mj.perception.points.range_flow import RangeFlow, empty_flow, range_flow
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.perceiving import box
from tests.raycast import Scene, cast
from tests.seeing_points import estimator
from tests.test_perception_motion import nothing_before, seen, sideways, times

PERIOD = 0.1  # [s]


def covariance(rng: np.random.Generator, std: float) -> np.ndarray:
    root = std * rng.normal(size=(2, 2))
    return root @ root.T + 0.01 * std**2 * np.eye(2)


def flows_along(normals: np.ndarray, speeds: np.ndarray, variance: float, poses: np.ndarray) -> RangeFlow:
    flows = empty_flow(len(speeds))
    flows.nx[:], flows.ny[:], flows.speed[:], flows.variance[:] = *normals.T, speeds, variance
    flows.poses_xx[:], flows.poses_xy[:], flows.poses_yy[:] = poses[0, 0], poses[0, 1], poses[1, 1]
    return flows


def track_of(velocity: np.ndarray, known: np.ndarray) -> np.ndarray:
    track = np.zeros(1, TRACK)
    track["vx"], track["vy"] = velocity
    track["cxx"], track["cxy"], track["cyy"] = known[0, 0], known[0, 1], known[1, 1]
    return track


def told(track: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    one = track[0]
    return np.array([one["vx"], one["vy"]]), np.array([[one["cxx"], one["cxy"]], [one["cxy"], one["cyy"]]])


def test_the_velocity_is_that_of_a_gaussian_of_it_and_of_the_error_that_all_flows_share():
    """Against the posterior of (v, b) given flows n.(v + b) + noise, four numbers at once, by linear algebra."""
    rng = np.random.default_rng(501)
    for _ in range(50):
        known, poses, variance = covariance(rng, 0.2), covariance(rng, 0.1), 0.05**2
        before, angles = 0.1 * rng.normal(size=2), rng.uniform(0.0, 2.0 * np.pi, 6)
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
        speeds = normals @ before + 0.02 * rng.normal(size=6)  # within the gate
        track = track_of(before, known)
        fuse_flows(track[0], (flows_along(normals, speeds, variance, poses), np.arange(6)), 0.0)
        prior, H = np.block([[known, np.zeros((2, 2))], [np.zeros((2, 2)), poses]]), np.hstack([normals, normals])
        gain = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + variance * np.eye(6))
        velocity, after = told(track)
        np.testing.assert_allclose(velocity, before + (gain @ (speeds - normals @ before))[:2], atol=1e-10)
        np.testing.assert_allclose(after, (prior - gain @ H @ prior)[:2, :2], atol=1e-10)


def test_without_flows_only_time_passes():
    known = covariance(np.random.default_rng(502), 0.1)
    track = track_of(np.array([0.1, 0.2]), known)
    fuse_flows(track[0], (empty_flow(0), np.zeros(0, np.int64)), 2.0)
    velocity, after = told(track)
    np.testing.assert_allclose(velocity, [0.1, 0.2])
    np.testing.assert_allclose(after, known + 2.0 * WALK_AT_REST**2 * np.eye(2), atol=1e-12)


def test_many_flows_of_one_scan_are_no_better_than_its_poses_and_many_scans_are():
    """Poses that are wrong by 6 cm/s hide 5 cm/s in one scan of 100 flows, but not in ten. The errors are as told."""
    rng, poses, normals = np.random.default_rng(503), 0.06**2 * np.eye(2), np.tile([[1.0, 0.0], [0.0, 1.0]], (50, 1))
    velocity, squares = np.array([-0.05, 0.0]), []
    for _ in range(200):
        track = track_of(np.zeros(2), 0.3**2 * np.eye(2))
        for count in range(10):
            seen_as = velocity + 0.06 * rng.normal(size=2)
            speeds = normals @ seen_as + 0.02 * rng.normal(size=100)
            flows = flows_along(normals, speeds, 0.02**2, poses)
            fuse_flows(track[0], (flows, np.arange(100)), PERIOD * count)
            track["time"] = PERIOD * count
            if count == 0:
                assert track["cxx"][0] > 0.05**2
        found, after = told(track)
        squares.append((found - velocity) @ np.linalg.solve(after, found - velocity))
    assert track["cxx"][0] < 0.03**2
    assert 1.0 < np.mean(squares) < 2.2  # 2 degrees of freedom; less, as the velocity does not walk here


def test_a_velocity_has_changed_if_what_all_flows_tell_is_far_from_it():
    """Against the distance between it and the posterior of a new track, by linear algebra."""
    rng, told_so = np.random.default_rng(504), 0
    for _ in range(200):
        known, poses, variance = covariance(rng, 0.02), covariance(rng, 0.02), 0.05**2
        before, angles = 0.01 * rng.normal(size=2), rng.uniform(0.0, 2.0 * np.pi, 12)
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
        speeds = normals @ (rng.uniform(0.0, 0.3) * np.array([1.0, 0.0]))
        prior = ANY_SPEED**2 * np.eye(2) + poses
        after = np.linalg.inv(np.linalg.inv(prior) + normals.T @ normals / variance)
        off = after @ normals.T @ speeds / variance - before
        expected = off @ np.linalg.solve(after + known, off) > MANEUVER
        flows = flows_along(normals, speeds, variance, poses)
        assert has_maneuvered(track_of(before, known)[0], (flows, np.arange(12)), 0.0) == expected
        assert not has_maneuvered(track_of(before, known)[0], (flows, np.arange(LEAST_FLOWS - 1)), 0.0)
        told_so += expected
    assert 50 < told_so < 150


def updated(track: np.ndarray, speeds: np.ndarray, of_faces: np.ndarray, time: float) -> np.ndarray:
    """The track at (1, 0) with flows of such speeds along x, of single echoes and of whole faces."""
    track["x"], track["live"] = 1.0, True
    flows = [flows_along(np.tile([1.0, 0.0], (len(s), 1)), s, 0.07**2, np.zeros((2, 2))) for s in (speeds, of_faces)]
    for one in flows:
        one.shared[:] = 0.0
    beside, along_faces = ((one, np.arange(len(one.x))) for one in flows)
    track_at(track, (1.0, 0.0, 0.0), beside, along_faces, time)
    return track


def test_what_has_rested_for_long_is_known_to_move_from_its_first_scan_on():
    """Flows of 0.2 m/s, each within three of its deviations from rest, which would draw it to 0.07 m/s in a scan."""
    track = updated(track_of(np.zeros(2), 0.01**2 * np.eye(2)), np.full(20, -0.2), np.zeros(0), 0.1)
    assert track["moves"][0]
    assert track["vx"][0] == pytest.approx(-0.2, abs=0.01)


def test_what_moves_goes_on_while_no_flow_tells_of_it():
    """At 5 cm/s, known to 1: 0.2 s without a scan that tells are enough for it to be a deviation from rest."""
    nothing = np.zeros(0)
    for time, moves in ((0.2, True), (UNSEEN, True), (UNSEEN + 0.01, False)):
        track = track_of(np.array([-0.05, 0.0]), 0.01**2 * np.eye(2))
        track["moves"] = True
        assert updated(track, nothing, nothing, time)["moves"][0] == moves


@pytest.mark.parametrize(("faces", "speed"), [(3, -0.3), (2, -0.05)])
def test_what_moves_is_as_fast_as_most_flows_of_its_faces_tell(faces: int, speed: float):
    """At 5 cm/s until now; of five flows so many tell of 0.3, all outside the gate, the others of nothing new."""
    track = track_of(np.array([-0.05, 0.0]), 0.005**2 * np.eye(2))
    track["moves"] = True
    told_by_faces = np.where(np.arange(5) < faces, -0.3, -0.05)
    updated(track, np.zeros(0), told_by_faces, 0.1)
    assert track["vx"][0] == pytest.approx(speed, abs=0.12)


@pytest.mark.parametrize("moves", [True, False])
def test_what_is_as_far_off_its_line_in_every_older_scan_has_not_moved(moves: bool):
    """A board is 12 cm nearer than 0.3 s ago: since 0.2 s ago by 8 cm if it moves, by 12 if it is another thing."""
    numbers, team = estimator()[0].parameters, (np.zeros((1, 1, 2)), 0)
    beams = len(numbers.directions)
    past, past_poses = np.zeros((3, beams), PAST_ECHO), np.zeros(3, PAST_POSE)
    for scan in range(4):
        x = 0.88 + 0.4 * PERIOD * (3 - scan) if moves else 1.0 - 0.12 * (scan == 3)
        ranges = cast(Scene(((x, -0.3, x, 0.3),)), np.zeros(3), beams, numbers.range_max)
        pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0 + PERIOD * scan, PERIOD)
        read = SeenBeams(ranges, numbers.directions)
        echoes = add_scan(no_points(1, beams)[0], 1, read, pose, team, nothing_before(beams), numbers)
        if scan < 3:
            store_scan(past[scan], past_poses[scan : scan + 1], (echoes, read), np.zeros(beams, np.int64), pose)
    order = scans_by_age(past_poses)
    resting = np.zeros(beams, np.int64), np.zeros(beams, bool)
    flows, count = range_flow((echoes, ranges), resting, (past, past_poses, order), pose, numbers)
    oldest = past[:1], past_poses[:1], order[:1]
    alone, of_all = range_flow((echoes, ranges), resting, oldest, pose, numbers)
    assert of_all > 3
    np.testing.assert_allclose(alone.speed[:of_all], 0.4, atol=1e-6)  # one older scan tells nothing else
    assert count == of_all if moves else count <= of_all / 3  # but at the ends of the face
    np.testing.assert_allclose(flows.speed[:count], 0.4, atol=1e-6)


def test_older_scans_are_asked_from_the_oldest_on_and_those_not_there_are_not():
    poses = np.zeros(4, PAST_POSE)
    assert len(scans_by_age(poses)) == 0
    poses["time"], poses["known"] = [0.3, 0.1, 0.0, 0.2], [True, True, False, True]
    np.testing.assert_array_equal(scans_by_age(poses), [1, 3, 0])


@pytest.mark.parametrize(("preset", "least"), [("default", 11), ("lidar", 8), ("robotarium", 11)])
def test_a_box_of_6_cm_a_second_is_known_to_come(preset: str, least: int):
    """From 0.5 m on, for 3 s, in so many of 12 cases: the points of lidar are of two scans, of the others six."""
    time, known_to = times(preset, 3.0), 0
    for seed in range(12):
        scenes = [box(0.6 + 0.06 * left, 0.0, 0.5) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, 0.0))
        ahead = int(np.argmax(np.where(known.active[0], known.G[0, :, 0], -1.0)))
        known_to += 0.03 < known.closing_speeds[0, ahead] < 0.12
    assert known_to >= least
