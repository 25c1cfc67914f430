"""Range flow of whole faces: one normal for all of a face, and nothing told of the speed along it."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import Echoes, add_scan
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.face_flow import face_flow
from pbrg_mj.perception.points.face_track import TRACK, WALK
from pbrg_mj.perception.points.fuse_flows import fuse_faces
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE, scans_by_age, store_scan
from pbrg_mj.perception.points.range_flow import RangeFlow, empty_flow, free_ends, range_flow
from pbrg_mj.perception.points.scan_faces import faces_of, scan_and_faces
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.schema import Scenario
from tests.perceiving import box
from tests.raycast import Scene
from tests.seeing_points import estimator, scan, sensor
from tests.test_perception_motion import SENSORS, nothing_before, seen, times

ELAPSED = 0.3  # [s]
Look = tuple[tuple[Echoes, SeenBeams], np.ndarray, ScanPose]  # a scan, its `free_ends`, where it was taken
Past = tuple[np.ndarray, np.ndarray]  # (beams,) of PAST_ECHO, (1,) of PAST_POSE


def looked_at(made: PointEstimator, given: Scenario, scene: Scene, frame: int) -> Look:
    """Echoes and beams, ends and pose of a noisy scan of a robot at the origin whose place is known exactly."""
    numbers, team = made.parameters, (np.zeros((1, 1, 2)), 0)
    beams = SeenBeams(scan(given, scene, np.zeros((1, 3)), frame).ranges[0], numbers.directions)
    pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, frame * ELAPSED, ELAPSED)
    before = nothing_before(len(beams.ranges))
    echoes = add_scan(no_points(1, len(beams.ranges))[0], 1, beams, pose, team, before, numbers)
    return (echoes, beams), free_ends(echoes, beams.ranges, pose, numbers), pose


def stored(look: Look) -> Past:
    past, past_pose = np.zeros(len(look[1]), PAST_ECHO), np.zeros(1, PAST_POSE)
    store_scan(past, past_pose, *look)
    return past, past_pose


def flows_of(made: PointEstimator, before: Past, look: Look, of_faces: bool = True) -> tuple[RangeFlow, int]:
    (echoes, beams), ends, pose = look
    told = ends, np.zeros(len(ends), bool)
    if of_faces:
        of_scan = scan_and_faces((echoes, beams), ends, pose, made.parameters)
        return face_flow((echoes, beams), of_scan, told[1], (before[0], before[1][0]), pose, made.parameters)
    past = before[0][None], before[1], scans_by_age(before[1])
    return range_flow((echoes, beams.ranges), told, past, pose, made.parameters)


@pytest.mark.parametrize("preset", SENSORS)
def test_a_face_has_one_normal_that_is_as_wrong_as_told(preset: str):
    """A box of 0.6 m, 0.4 m ahead: neighbouring echoes are turned by up to 30 deg, its face by 0.3 to 4."""
    (made, given), rng, errors = estimator(sensor(preset)), np.random.default_rng(91), []
    for frame in range(150):
        angle = rng.uniform(-0.3, 0.3)
        past, _ = stored(looked_at(made, given, box(0.7, 0.0, 0.6, angle=angle), frame))
        faces = faces_of(past, (0.0, 0.0), made.parameters)
        ahead = np.flatnonzero(faces.found & (faces.nx < -0.8))
        if len(ahead):
            k = ahead[np.argmin(faces.variance[ahead])]
            turn = np.arctan2(-faces.ny[k], -faces.nx[k]) - angle
            errors.append((turn**2, faces.variance[k]))
    squares, told = np.array(errors).T
    assert len(errors) > 100
    assert 0.5 < np.mean(squares / told) < 1.7
    assert np.degrees(np.sqrt(np.median(told))) < 4.0


def test_a_corner_parts_two_faces():
    made, given = estimator(sensor("lidar"))
    past, _ = stored(looked_at(made, given, box(0.8, 0.0, 0.4, angle=np.pi / 4), 1))
    faces = faces_of(past, (0.0, 0.0), made.parameters)
    angles = np.degrees(np.arctan2(faces.ny, faces.nx))[faces.found]
    assert len(angles) > 30
    assert np.abs(np.abs(angles) - 135.0).max() < 3.0
    assert angles.min() < 0.0 < angles.max()


@pytest.mark.parametrize("preset", SENSORS)
def test_flow_of_faces_is_the_speed_along_their_normals(preset: str):
    """A box comes and slides past, two of its faces in view: unbiased, and as wrong as told."""
    (made, given), velocity, errors, told, slanted = estimator(sensor(preset)), np.array([-0.15, -0.25]), [], [], 0
    for frame in range(0, 160, 2):
        start = np.array([0.75, 0.3 + 0.002 * frame])
        scenes = (box(*(start + velocity * ELAPSED * step), 0.5) for step in (0, 1))
        then, now = (looked_at(made, given, scene, frame + step) for step, scene in enumerate(scenes))
        flows, count = flows_of(made, stored(then), now)
        n = np.column_stack([flows.nx, flows.ny])[:count]
        of_face = ~flows.of_end[:count]
        errors += list((flows.speed[:count] - n @ velocity)[of_face])
        told += list(flows.variance[:count][of_face])
        slanted += np.count_nonzero(of_face & (n[:, 1] < -0.9))
    assert len(errors) > 80 and (slanted > 40 or preset == "tof_ring")
    squares = np.square(errors) / told
    assert np.median(squares) < 0.8  # 0.45 of honest ones
    assert np.mean(squares > 9.0) < 0.05
    assert abs(np.median(errors)) < 0.02


def test_lines_of_two_echoes_tell_of_the_speed_along_a_face_and_whole_faces_do_not():
    """The information on it per flow, n_y^2 / variance, of a face ahead along y whose ends are out of view."""
    made, given = estimator(sensor("lidar"))
    told: dict[bool, list[float]] = {False: [], True: []}
    for frame in range(0, 40, 2):
        then, now = (looked_at(made, given, box(0.9, 0.0, 1.0), frame + step) for step in (0, 1))
        for of_faces in told:
            flows, count = flows_of(made, stored(then), now, of_faces)
            middle = np.flatnonzero((np.abs(flows.y[:count]) < 0.3) & ~flows.of_end[:count])
            told[of_faces] += list(flows.ny[middle] ** 2 / flows.variance[middle])
    assert np.mean(told[False]) > 10.0 > 10.0 * np.mean(told[True])


def test_a_corner_is_no_free_end():
    """Beams pass by the line of one face there, but meet the other: by itself the corner seems to be an end."""
    (made, given), rng, ends = estimator(), np.random.default_rng(514), {False: 0, True: 0}
    for frame in range(0, 120, 2):
        width, turn = rng.uniform(0.3, 0.5), rng.uniform(0.6, 1.0)
        corner = np.array([rng.uniform(0.3, 0.6), 0.0])
        x, y = corner + width / np.sqrt(2.0) * np.array([np.cos(turn - np.pi / 4), np.sin(turn - np.pi / 4)])
        then, now = (looked_at(made, given, box(x, y, width, angle=turn), frame + step) for step in (0, 1))
        for of_faces in (False, True):
            flows, count = flows_of(made, stored(then), now, of_faces)
            places = np.column_stack([flows.x, flows.y])[:count][flows.of_end[:count]]
            ends[of_faces] += int(np.count_nonzero(np.linalg.norm(places - corner, axis=1) < 0.05))
    assert ends[False] > 5 and ends[True] == 0


def some_flows(directions: np.ndarray, speed: np.ndarray, variance: float, of_end: bool) -> RangeFlow:
    """Flows along unit vectors (F, 2) that share nothing."""
    flows = empty_flow(len(directions))
    flows.nx[:], flows.ny[:], flows.speed[:] = directions[:, 0], directions[:, 1], speed
    flows.variance[:], flows.shared[:], flows.of_end[:] = variance, 0.0, of_end
    return flows


def moving_track(velocity: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    track = np.zeros(1, TRACK)
    track["vx"], track["vy"], track["live"], track["moves"] = *velocity, True, True
    track["cxx"], track["cxy"], track["cyy"] = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    return track


def covariance_of(track: np.ndarray) -> np.ndarray:
    cxy = track["cxy"][0]
    return np.array([[track["cxx"][0], cxy], [cxy, track["cyy"][0]]])


@pytest.mark.parametrize("of_end", [False, True])
def test_a_flow_of_a_face_changes_the_velocity_along_its_normal_alone(of_end: bool):
    """The covariance is Joseph's of that gain; of an end it is the Kalman filter's."""
    rng, velocity = np.random.default_rng(92), np.array([0.1, -0.3])
    root, n = rng.normal(size=(2, 2)) * 0.1, np.array([np.cos(0.4), np.sin(0.4)])
    P, r = root @ root.T + 0.001 * np.eye(2), 0.002
    track = moving_track(velocity, P)
    fuse_faces(track[0], (some_flows(n[None], np.array([n @ velocity + 0.05]), r, of_end), np.arange(1)), 0.0)
    K = (P @ n if of_end else n * (n @ P @ n)) / (n @ P @ n + r)
    left = np.eye(2) - np.outer(K, n)
    assert np.array([track["vx"][0], track["vy"][0]]) == pytest.approx(velocity + 0.05 * K)
    assert covariance_of(track) == pytest.approx(left @ P @ left.T + r * np.outer(K, K))


def test_normals_with_errors_do_not_draw_the_speed_along_a_face_to_rest():
    """Ten flows a scan for 3 s, 10 scans a second, along normals that are wrong by 3 deg, anew in each scan.

    With the Kalman filter's gain less than a third of 0.3 m/s would be left.
    """
    rng, velocity = np.random.default_rng(93), np.array([-0.1, 0.3])
    track = moving_track(velocity, 0.02**2 * np.eye(2))
    for k in range(1, 31):
        angle = np.full(10, np.radians(3.0) * rng.normal())
        n = np.column_stack([np.cos(angle), np.sin(angle)])
        flows = some_flows(n, velocity[0] + 0.02 * rng.normal(size=10), 0.02**2, False)
        fuse_faces(track[0], (flows, np.arange(10)), 0.1 * k)
        track["time"] = 0.1 * k
    assert track["vy"][0] == pytest.approx(velocity[1], abs=0.03)
    assert np.sqrt(track["cyy"][0]) == pytest.approx(np.hypot(0.02, WALK * np.sqrt(3.0)), rel=0.05)


@pytest.mark.parametrize("preset", ["default", "lidar", "robotarium"])
def test_a_box_that_slides_past_keeps_its_speed(preset: str):
    """Its front face slides 0.3 m ahead, its side is in view at 60 to 80 deg: by lines of two echoes it stood still."""
    time, velocity, errors = times(preset, 3.6), np.array([-0.03, -0.2]), []
    for seed in range(6):
        scenes = [box(0.5 + velocity[0] * t, 0.72 + velocity[1] * t, 0.4) for t in time]
        for t, known in zip(time, seen(preset, seed, scenes, np.zeros((len(time), 3))), strict=True):
            middle = np.array([0.5, 0.72]) + velocity * t
            corners = middle + 0.2 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
            for k in np.flatnonzero(known.active[0]):
                normal, edge = known.G[0, k], float((corners @ known.G[0, k]).min())
                if t > 1.2 and -normal @ velocity > 0.1 and edge < 0.5:
                    errors.append(known.closing_speeds[0, k] + normal @ velocity)
    assert len(errors) > 30
    assert np.mean(np.array(errors) < -0.05) < 0.03
    assert np.median(errors) < 0.06
