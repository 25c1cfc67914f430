"""Cones and lidars that turn: team-mates bind nobody, walls stay where they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pbrg_mj.perception.scan.team_mates import distance_from_arc
from pbrg_mj.perception.track.deskew import deskewed, poses_at
from pbrg_mj.perception.track.pose_history import PoseHistory, exposure, scanned
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import box, rows
from tests.raycast import Scene, cast
from tests.seeing_points import ROBOT, estimator, sensor

WALL = 1.6  # [m] to the left
Way = Callable[[float], np.ndarray]
Walls = Scene | Callable[[float], Scene]  # what stands, or moves: at a time


def ring(seed: int, speed: float, turn: float) -> Way:
    """Robot 1 turns at `turn` [rad/s] amid five that go to and fro at `speed` [m/s]; poses (6, 3) at a time."""
    rng = np.random.default_rng([17, seed])
    angle = 2.0 * np.pi * (np.arange(5) + rng.uniform(-0.3, 0.3, 5)) / 5
    reach, heading = rng.uniform(0.35, 1.1, 5), rng.uniform(-np.pi, np.pi, 5)
    places = reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    ways = np.column_stack([np.cos(heading), np.sin(heading)])

    def poses(time: float) -> np.ndarray:
        along = speed * (abs((time % 1.0) - 0.5) - 0.25)
        own = [[0.5 * along, 0.0, turn * time]]
        return np.concatenate([own, np.column_stack([places + along * ways, heading])])

    return poses


def row(seed: int, speed: float, turn: float) -> Way:
    """Robot 1 turns at `turn` [rad/s] before four abreast that go to and fro at `speed` [m/s]; the sixth is far."""
    rng = np.random.default_rng([91, seed])
    reach, gap = rng.uniform(0.5, 1.5), rng.uniform(0.14, 0.5)
    places = np.array([[reach, (k - 1.5) * gap, 0.0] for k in range(4)] + [[3.9, 3.9, 0.0]])

    def poses(time: float) -> np.ndarray:
        others = places.copy()
        others[:4, 0] += 0.5 * speed * (abs((time % 4.0) - 2.0) - 1.0)
        return np.concatenate([[[0.0, 0.0, turn * time]], others])

    return poses


def look(given: Scenario, way: Way, walls: Walls, time: float, frame: int) -> np.ndarray:
    """What robot 1 reads in the scan that ends at `time`, of cones as of a turn, before noise (1, beams)."""
    beams = given.sensors.beams
    raw = np.full(beams.count, np.nan)
    across = np.deg2rad(beams.cone_deg) * np.linspace(-0.5, 0.5, beams.rays) if beams.rays > 1 else [0.0]
    for k in range(beams.count if beams.scan_time else 1):
        then = time - beams.scan_time * (1.0 - (k + 1) / beams.count)
        poses = way(then)
        standing = walls(then) if callable(walls) else walls
        scene = Scene((), tuple((x, y, ROBOT.body_radius) for x, y, _ in poses[1:])) + standing
        if beams.scan_time:
            angle = 2.0 * np.pi * k / beams.count
            raw[k] = cast(scene, poses[0] + [0.0, 0.0, angle], 1, beams.range_max)[0]
        else:
            fan = [cast(scene, poses[0] + [0.0, 0.0, angle], beams.count, beams.range_max) for angle in across]
            raw = np.fmin.reduce(fan)
    raw = np.nan_to_num(raw, nan=-1.0)
    raw[raw < beams.range_min] = -1.0
    return noisy_scan(raw, sensor_noise(given), stream(given.seed, Source.BEAMS, 0, frame))[None]


def scans(preset: str, way: Way, walls: Walls, seed: int, count: int):
    """Yield the half-spaces after each scan; the camera tells poses 30 times a second."""
    made, given = estimator(
        {"beams": {"preset": preset, "robots": [1]}, "camera": {"rate_hz": 30.0}}, formation=((0.0, 0.0),) * 6
    )
    given = given.model_copy(update={"seed": seed})
    memory, period = made.init(), 1.0 / given.sensors.beams.rate_hz
    frames = round(30.0 * period)
    for tick in range(count * frames + 1):
        time, noise = tick / 30.0, sensor_noise(given)
        draws = stream(seed, Source.CAMERA, 0, tick).standard_normal((6, 3))
        seen = way(time) + draws * [noise.position_std, noise.position_std, noise.heading_std]
        new = tick > 0 and tick % frames == 0
        ranges = look(given, way, walls, time, tick) if new else np.full((1, given.sensors.beams.count), np.nan)
        known, memory = made.step_towards(
            Readings(seen, ranges, new, tick, tick // frames), time, memory, np.zeros((6, 2))
        )
        if new:
            yield time, known, memory


@pytest.mark.parametrize(("preset", "count"), [("tof_cones", 60), ("lds_02", 12)])
@pytest.mark.parametrize("speed", [0.0, 0.01, 0.3], ids=["rest", "creep", "drive"])
@pytest.mark.parametrize("stand", [ring, row], ids=["around", "abreast"])
def test_team_mates_bind_nobody(
    preset: str, count: int, speed: float, stand: Callable[[int, float, float], Way]
) -> None:
    turn = 1.0 if preset == "lds_02" else 0.3
    for seed in range(3):
        seen = list(scans(preset, stand(seed, speed, turn), Scene(), seed, count))
        assert [time for time, known, _ in seen if known.active[0].any()] == []
        assert seen[-1][2].scans == count and len(seen) == count


def test_team_mates_around_a_robot_that_oscillates_bind_nobody_between_frames() -> None:
    """Eight scans a second lie up to 25 ms after frames; at 1.5 Hz and 25 deg the heading is 2 deg off if held."""
    beams = {"preset": "lidar", "robots": [1]}
    for seed in range(4):
        made, given = estimator({"beams": beams, "camera": {"rate_hz": 30.0}}, formation=((0.0, 0.0),) * 6)
        noise, model, memory, m = sensor_noise(given), made.parameters.pose, made.init(), np.zeros((6, 2))
        rest, bound = ring(seed, 0.0, 0.0)(0.0), []

        def way(time: float, rest: np.ndarray = rest) -> np.ndarray:
            return rest + np.array([[0.0, 0.0, np.deg2rad(25.0) * np.sin(3.0 * np.pi * time)]] + [[0.0] * 3] * 5)

        scan, seen = -1, way(0.0)
        for frame in range(90):
            time = exposure(frame, model)
            draws = stream(seed, Source.CAMERA, 0, frame).standard_normal((6, 3))
            seen = way(time) + draws * [noise.position_std, noise.position_std, noise.heading_std]
            readings = Readings(seen, np.full((1, 360), np.nan), False, frame, scan)
            _, memory = made.step_towards(readings, time, memory, m)
            while scanned(scan + 1, model) < exposure(frame + 1, model) - 1e-9:
                scan += 1
                taken = scanned(scan, model)
                ranges = look(given, way, Scene(), taken, scan)
                known, memory = made.step_towards(Readings(seen, ranges, True, frame, scan), taken, memory, m)
                bound += [taken] * bool(known.active[0].any())
        assert bound == [] and scan > 20


@pytest.mark.parametrize(("preset", "turn"), [("tof_cones", 0.3), ("lds_02", 1.0)])
def test_a_wall_behind_team_mates_stays_where_it_is(preset: str, turn: float) -> None:
    """Half-spaces keep hand points off the wall by the clearance, straight ahead by no more than noise asks.

    Noise is 11 mm of cones and 29 mm of the lidar at that range; the least of all the echoes of a wall binds.
    """
    wall = Scene(((-5.0, WALL, 5.0, WALL),))
    for seed in range(2):
        *_, (_, known, _) = scans(preset, ring(seed, 0.3, turn), wall, seed, 8)
        G, h = rows(known)
        assert len(G) > 0
        ahead = G[:, 1] > 0.1
        short = [WALL - ROBOT.clearance - np.min((h - G[:, 0] * x)[ahead] / G[ahead, 1]) for x in (-0.4, 0.0, 0.4)]
        assert min(short) > -0.01
        assert short[1] < 0.15


def test_places_that_a_cone_may_have_heard_are_those_of_its_arc() -> None:
    rng = np.random.default_rng(3)
    made, _ = estimator(sensor("tof_cones"))
    half = made.parameters.half_cone
    assert half == pytest.approx(np.deg2rad(13.5))
    turns = np.linspace(-half, half, 20001)
    for _ in range(50):
        x, y, along, angle = *rng.uniform(-1.5, 1.5, 2), rng.uniform(0.1, 2.0), rng.uniform(-np.pi, np.pi)
        arc = along * np.column_stack([np.cos(angle + turns), np.sin(angle + turns)])
        middle = (along * np.cos(angle), along * np.sin(angle))
        nearest = np.min(np.linalg.norm(arc - [x, y], axis=1))
        assert np.sqrt(distance_from_arc(x, y, middle, half)) == pytest.approx(nearest, abs=1e-6)


def test_a_turning_scan_is_put_where_its_echoes_were() -> None:
    """A robot on a circle before a wall, poses and ranges exact: every echo lies on the wall."""
    made, given = estimator({"beams": {"preset": "lds_02", "noise_std": 0.0, "noise_ratio": 0.0}})
    speed, turn = 0.3, 1.0

    def way(time: float) -> np.ndarray:
        heading = 0.4 + turn * time
        radius = speed / turn
        return np.array([[radius * np.sin(heading), -radius * np.cos(heading), heading]])

    times = np.arange(0.0, 0.61, 0.02)
    history = PoseHistory(times, np.array([way(time) for time in times]))
    beams, wall = given.sensors.beams, Scene(((-5.0, WALL, 5.0, WALL),))
    ranges = np.full((1, beams.count), np.nan)
    for k in range(beams.count):
        begun = 0.6 - beams.scan_time * (1.0 - (k + 1) / beams.count)
        pose = way(np.ceil(begun / 0.002 - 1e-6) * 0.002)[0]  # at the first step of physics that it is due
        ranges[0, k] = cast(wall, pose + np.array([0.0, 0.0, 2.0 * np.pi * k / beams.count]), 1, 8.0)[0]
    seen = deskewed(Readings(way(0.6), ranges, True, 0, 3), history, way(0.6), np.array([0]), made.parameters)
    _, y, heading = way(0.6)[0]
    local = seen.ranges[0][:, None] * seen.directions[0]
    found = y + np.sin(heading) * local[:, 0] + np.cos(heading) * local[:, 1]
    heard = np.isfinite(ranges[0])
    np.testing.assert_array_equal(np.isfinite(seen.ranges[0]), heard)
    assert heard.sum() > 100
    assert np.abs(found[heard] - WALL).max() < 1e-3
    flat = y + ranges[0] * np.sin(heading + 2.0 * np.pi * np.arange(beams.count) / beams.count)
    assert np.nanmax(np.abs(flat - WALL)) > 0.05


def test_poses_between_frames() -> None:
    """Steady motion is met at every time, through half a turn as well; before the first frame robots are there."""
    times = np.array([0.0, 0.1, 0.2, 0.3])

    def way(time: np.ndarray) -> np.ndarray:
        return np.stack([0.3 * time, -0.1 * time, 3.0 + 1.5 * time], axis=-1)[:, None]

    poses = way(times)
    poses[..., 2] = np.remainder(poses[..., 2] + np.pi, 2 * np.pi) - np.pi
    asked = np.array([0.05, 0.1, 0.27, 0.3])
    off = poses_at(PoseHistory(times, poses), asked) - way(asked)
    off[..., 2] = np.remainder(off[..., 2] + np.pi, 2 * np.pi) - np.pi
    np.testing.assert_allclose(off, 0.0, atol=1e-12)
    np.testing.assert_array_equal(poses_at(PoseHistory(times, poses), np.array([-1.0]))[0], poses[0])


def test_scans_at_once_are_taken_as_they_are() -> None:
    made, _ = estimator(sensor("tof_cones"))
    readings = Readings(np.zeros((1, 3)), np.ones((1, 24)), True, 0, 0)
    memory = made.init()
    seen = deskewed(readings, memory.history, readings.body_pose, made.robots, made.parameters)
    assert seen.ranges is readings.ranges
    np.testing.assert_array_equal(seen.directions[0], made.parameters.directions)
    _, memory = made.step_towards(readings, 0.0, memory, None)
    _, after = made.step_towards(readings._replace(new_scan=False), 0.01, memory, None)
    assert after is memory


def test_cones_and_turns_are_assumed_and_may_be_wrong() -> None:
    thin, _ = estimator(sensor("tof_cones"), assumed={"beams": {"cone_deg": 0.0}})
    still, _ = estimator(sensor("lds_02"), assumed={"beams": {"scan_time": 0.0}})
    assert thin.parameters.half_cone == 0.0
    assert still.parameters.scan_time == 0.0 and len(still.init().history.time) == 0


def turning(speed: float) -> Way:
    """Robot 1 turns to and fro at the origin, at up to `speed` [rad/s], and the others are far away."""

    def poses(time: float) -> np.ndarray:
        others = np.column_stack([np.full(5, -3.0), np.arange(5.0), np.zeros(5)])
        return np.concatenate([[[0.0, 0.0, 0.5 * np.sin(2.0 * speed * time)]], others])

    return poses


@pytest.mark.parametrize("turn", [-2.0, -0.7, 0.7, 2.0])
def test_a_face_does_not_end_where_a_scan_begins(turn: float) -> None:
    """A robot turns before a wall of 0.8 m, on which scans begin, each elsewhere. Single beams have outliers."""
    begun, off, way = 0, [], turning(turn)
    for time, _, memory in scans("lds_02", way, Scene(((1.1, -0.4, 1.1, 0.4),)), 61, 40):
        past = memory.past[0, int(np.argmax(memory.past_poses[0]["time"]))]
        ends = past[past["external"] & (past["range"] < 1.5) & (past["ends"] > 0)]
        off += list(np.abs(np.abs(ends["y"]) - 0.4))
        begun += abs(1.1 * np.tan(way(time)[0, 2])) < 0.3
    assert begun > 10 and len(off) > 60
    assert max(off) < 0.06


def test_how_a_box_moves_along_its_face_is_known_to_a_robot_that_turns() -> None:
    """It comes nearer slowly. How it moves along the face only the ends of that tell; a scan begins on it."""
    errors, way = [], turning(1.0)
    for seed in range(4):
        across = 0.2 * (-1.0) ** seed

        def walls(time: float, across: float = across) -> Scene:
            return box(1.3 - 0.15 * time, across * (time - 2.0), 0.4)

        *_, (_, _, memory) = scans("lds_02", way, walls, 70 + seed, 14)
        tracks = memory.tracks[0][memory.tracks[0]["live"] & memory.tracks[0]["moves"]]
        newest = tracks[np.argmax(tracks["time"])]
        errors.append(abs(newest["vy"] - across))
    assert max(errors) < 0.1
