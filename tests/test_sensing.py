"""Noise: held frames, statistics, independence, and no invented points."""

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.random_streams import Source, Streams, stream
from pbrg_mj.scenario.schema import Beams, Camera, Operator, Scenario, Sensors, Team
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.frame_buffer import FrameBuffer
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.interface import Observation

ROBOTS, BEAMS = 3, 50
NOISE = SensorNoise(7, (0, 1, 2), 0.01, 0.02, 0.07, 4.0, 0.005, 0.0)


def observation(frame: int, ranges: np.ndarray | float = 1.0) -> Observation:
    pose = np.arange(3.0 * ROBOTS).reshape(ROBOTS, 3)
    return Observation(pose, frame, np.broadcast_to(ranges, (ROBOTS, BEAMS)).astype(float), frame)


def errors(frames: range, noise: SensorNoise = NOISE) -> tuple[np.ndarray, np.ndarray]:
    readings = [sense(observation(frame), None, noise) for frame in frames]
    poses = np.array([reading.body_pose for reading in readings]) - observation(0).body_pose
    return poses, np.array([reading.ranges for reading in readings]) - 1.0


def scenario(**changes: object) -> Scenario:
    team = Team(start=((0, 0), (1, 0), (2, 0)), formation=((0, 0),) * 3, leaders=(1,))
    return Scenario.model_validate({"team": team, "operator": Operator(reference=(0, 0)), **changes})


def test_readings_are_held_bit_for_bit_between_frames() -> None:
    first = sense(observation(4), None, NOISE)
    moved = observation(4, 2.0)._replace(body_pose=np.ones((ROBOTS, 3)))
    held = sense(moved, first, NOISE)
    assert first.new_scan and not held.new_scan
    assert np.array_equal(held.body_pose, first.body_pose) and np.array_equal(held.ranges, first.ranges)


def test_pose_and_scan_are_renewed_apart() -> None:
    first = sense(observation(4), None, NOISE)
    second = sense(observation(4)._replace(pose_frame=5), first, NOISE)
    assert np.all(second.body_pose != first.body_pose) and np.array_equal(second.ranges, first.ranges)
    third = sense(observation(4)._replace(pose_frame=5, scan_frame=5), second, NOISE)
    assert third.new_scan and np.array_equal(third.body_pose, second.body_pose)
    assert np.all(third.ranges != second.ranges)


def test_a_frame_does_not_depend_on_the_frames_seen_before() -> None:
    reading = None
    for frame in range(6):
        reading = sense(observation(frame), reading, NOISE)
    skipped = sense(observation(5), sense(observation(0), None, NOISE), NOISE)
    assert reading is not None
    assert np.array_equal(reading.body_pose, skipped.body_pose) and np.array_equal(reading.ranges, skipped.ranges)


def test_mean_and_deviation_are_the_configured_ones() -> None:
    poses, ranges = errors(range(2000))
    count = poses.shape[0] * ROBOTS
    for axis, std in enumerate((0.01, 0.01, 0.02)):
        sample = poses[:, :, axis]
        assert abs(sample.mean()) < 3.5 * std / np.sqrt(count)
        assert sample.std() == pytest.approx(std, rel=3.5 / np.sqrt(2 * count))
    assert abs(ranges.mean()) < 3.5 * 0.005 / np.sqrt(ranges.size)
    assert ranges.std() == pytest.approx(0.005, rel=3.5 / np.sqrt(2 * ranges.size))


def test_robots_beams_frames_and_seeds_are_independent() -> None:
    poses, ranges = errors(range(1000))
    other_poses, other_ranges = errors(range(1000), replace(NOISE, seed=8))
    bound = 4.5 / np.sqrt(1000)  # of 1,711 + 59 + 59 sample correlations of independent series
    series = np.hstack([poses.reshape(1000, -1), ranges[:, :, :BEAMS].reshape(1000, -1)[:, ::3]])
    correlation = np.corrcoef(series, rowvar=False) - np.eye(series.shape[1])
    assert np.abs(correlation).max() < bound
    for column in range(series.shape[1]):
        assert abs(np.corrcoef(series[:-1, column], series[1:, column])[0, 1]) < bound
    others = np.hstack([other_poses.reshape(1000, -1), other_ranges.reshape(1000, -1)[:, ::3]])
    for column in range(series.shape[1]):
        assert abs(np.corrcoef(series[:, column], others[:, column])[0, 1]) < bound


def test_dropout_takes_its_share() -> None:
    _, ranges = errors(range(400), replace(NOISE, dropout=0.2))
    share = np.isnan(ranges).mean()
    assert abs(share - 0.2) < 3.5 * np.sqrt(0.2 * 0.8 / ranges.size)
    _, all_seen = errors(range(400))
    assert np.array_equal(ranges[~np.isnan(ranges)], all_seen[~np.isnan(ranges)])


@pytest.mark.parametrize("raw", [-1.0, 0.0, 0.069, 4.0, 4.3, np.nan])
def test_no_point_where_nothing_was_hit(raw: float) -> None:
    noise = replace(NOISE, range_std=1.0)  # so large that noise alone could bring a range back
    assert np.isnan(sense(observation(0, raw), None, noise).ranges).all()


def test_noise_that_leaves_the_range_is_no_hit() -> None:
    ranges = np.array([sense(observation(frame, 3.999), None, NOISE).ranges for frame in range(50)])
    assert 0.4 < np.isnan(ranges).mean() < 0.6
    assert np.nanmax(ranges) < 4.0
    near = np.array([sense(observation(frame, 0.07), None, NOISE).ranges for frame in range(50)])
    assert 0.4 < np.isnan(near).mean() < 0.6 and np.nanmin(near) >= 0.07


def test_nothing_before_the_first_frame() -> None:
    reading = sense(observation(-1), None, NOISE)
    assert np.isnan(reading.body_pose).all() and np.isnan(reading.ranges).all() and not reading.new_scan
    assert sense(observation(0), reading, NOISE).new_scan


def test_the_ideal_plant_is_seen_exactly() -> None:
    exact = sensor_noise(scenario(plant="ideal", sensors=Sensors(beams=Beams(dropout=0.5))))
    reading = sense(observation(3), None, exact)
    assert np.array_equal(reading.body_pose, observation(3).body_pose)
    assert np.array_equal(reading.ranges, observation(3).ranges)


def test_the_scenario_sets_the_noise() -> None:
    sensors = Sensors(
        beams=Beams(robots=(3, 1), noise_std=0.02, dropout=0.1),
        camera=Camera(position_std=0.003, heading_std_deg=90),
    )
    noise = sensor_noise(scenario(seed=11, sensors=sensors))
    assert noise == SensorNoise(11, (0, 2), 0.003, np.pi / 2, 0.07, 4.0, 0.02, 0.1)
    assert scenario().beam_robots == (0, 1, 2)


def test_a_robot_keeps_its_noise_when_others_lose_their_beams() -> None:
    alone = replace(NOISE, beam_robots=(2,))
    seen = sense(observation(9)._replace(ranges=np.ones((1, BEAMS))), None, alone)
    assert np.array_equal(seen.ranges[0], sense(observation(9), None, NOISE).ranges[2])


def test_no_beams_at_all() -> None:
    reading = sense(observation(2)._replace(ranges=np.zeros((0, BEAMS))), None, replace(NOISE, beam_robots=()))
    assert reading.ranges.shape == (0, BEAMS)


def test_biases_are_added_to_what_is_seen_and_to_nothing_else() -> None:
    """Without noise the errors are the biases; beams that hit nothing stay so."""
    sensors = Sensors(
        beams=Beams(preset="ideal", bias=(0.1, 0.0, -0.3), range_max=4.0, robots=(1, 3)),
        camera=Camera(position_std=0, heading_std_deg=0, bias_x=(0.1, 0.2, 0.3), bias_y=-0.5, heading_bias_deg=90.0),
    )
    noise = sensor_noise(scenario(sensors=sensors))
    ranges = np.tile([-1.0, 0.2, 1.0, 3.99, 4.0], (2, 1))
    seen = sense(Observation(observation(0).body_pose, 0, ranges, 0), None, noise)
    error = seen.body_pose - observation(0).body_pose
    np.testing.assert_allclose(error, [[x, -0.5, np.pi / 2] for x in (0.1, 0.2, 0.3)], atol=1e-12)
    np.testing.assert_allclose(seen.ranges, [[np.nan, 0.3, 1.1, np.nan, np.nan], [np.nan, np.nan, 0.7, 3.69, np.nan]])


def test_no_bias_changes_no_bit_and_the_ideal_plant_has_none() -> None:
    plain, biased = (sensor_noise(scenario(sensors=Sensors(beams=Beams(bias=bias)))) for bias in (0.0, (0.0, 0.0, 0.0)))
    assert plain == biased and plain.range_bias == plain.pose_bias == ()
    ideal = {"plant": "ideal", "estimator": {"source": "given"}, "sensors": Sensors(camera=Camera(bias_x=1.0))}
    assert sensor_noise(scenario(**ideal)).pose_bias == ()


@pytest.mark.parametrize("key", ["beams.bias", "camera.bias_x", "camera.bias_y", "camera.heading_bias_deg"])
def test_as_many_biases_as_robots(key: str) -> None:
    with pytest.raises(InputError, match=rf"sensors.{key}: has 2 entries; allowed: one number, or 5, one per robot"):
        load_scenario("paper/experiment_near", [f"sensors.{key}=[0.1, 0.2]"])


def test_numbers_drawn_ahead_are_those_of_their_frames() -> None:
    """In whatever order frames are asked for, with some left out; and no more are drawn than in a row."""
    drawn, draws = [], FrameBuffer(16)
    for frame in [0, 1, 2, 20, 23, 26, 27, 28, 45]:
        assert draws.at(frame, lambda one: (drawn.append(one), 10 * one)[1]) == 10 * frame
    assert len(drawn) == 16 + 1 + 1 + 1 + 16 + 1


def test_frames_have_the_noise_of_their_own_streams() -> None:
    """Poses and ranges of a frame are those of its streams alone, whichever frames were seen before."""
    noise, rows = sensor_noise(scenario()), range(ROBOTS)
    for frame in [0, 1, 2, 20, 23]:
        seen, raw = observation(frame), observation(frame).ranges
        alone = sense(seen, None, noise)
        normal = [Streams(noise.seed, Source.CAMERA).at(robot, frame).standard_normal(3) for robot in rows]
        np.testing.assert_array_equal(alone.body_pose, seen.body_pose + noise.pose_std * normal)
        randoms = [stream(noise.seed, Source.BEAMS, robot, frame) for robot in noise.beam_robots]
        expected = [noisy_scan(row, noise, random) for row, random in zip(raw, randoms, strict=True)]
        np.testing.assert_array_equal(alone.ranges, expected)
