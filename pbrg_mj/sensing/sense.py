"""From raw samples to readings: seeded noise and held frames."""

from __future__ import annotations

from functools import partial

import numpy as np

from pbrg_mj.scenario.schema import WHITE
from pbrg_mj.sensing.beam_model import beam_numbers, reported_scans
from pbrg_mj.sensing.cone import nearest_in_cones, values_of_rays
from pbrg_mj.sensing.noise import BeamNumbers, SensorNoise
from pbrg_mj.sensing.pose_filter import (
    FilterMemory,
    FilterParameters,
    corrected,
    driven,
    encoder_angles,
    initial_memory,
)
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.signal_strength import echo_probability, relative_power
from pbrg_mj.sensing.ultra_wideband import measured_ranges, place_of
from pbrg_mj.world.plant.interface import Observation


def sense(observation: Observation, previous: Readings | None, noise: SensorNoise) -> Readings:
    """Return what the robots see of `observation`; pass None as `previous` in the first tick.

    A reading changes only with its frame number and is held bit for bit in between. When several frames have
    passed since the previous tick only the latest counts. Before a sensor's first frame its readings are NaN. A frame
    of the camera that is lost is none.
    """
    if previous is not None and noise.pose_filter is None and _held(observation, previous):
        return previous._replace(new_scan=False) if previous.new_scan else previous
    pose_frame, faults = observation.pose_frame, noise.camera_faults
    if previous is not None and faults is not None and faults.is_lost(pose_frame, noise.seed):
        pose_frame = previous.pose_frame
    if previous is not None and pose_frame == previous.pose_frame:
        body_pose = _camera_poses(previous)
    else:
        body_pose = _poses(observation, noise)
        if faults is not None:
            body_pose = faults.applied(body_pose, None if previous is None else _camera_poses(previous), pose_frame)
    memory = None
    if noise.pose_filter is not None and pose_frame >= 0:
        memory = _filtered(observation, previous, (body_pose, pose_frame), noise, noise.pose_filter)
        body_pose = memory.now.pose
    if previous is not None and observation.scan_frame == previous.scan_frame:
        ranges, new_scan = previous.ranges, False
    else:
        ranges, new_scan = _ranges(observation, noise), observation.scan_frame >= 0
    return Readings(body_pose, ranges, new_scan, pose_frame, observation.scan_frame, memory)


def _held(observation: Observation, previous: Readings) -> bool:
    return observation.pose_frame == previous.pose_frame and observation.scan_frame == previous.scan_frame


def _poses(observation: Observation, noise: SensorNoise) -> np.ndarray:
    """Return (n, 3) poses with Gaussian noise on x, y [m] and heading [rad]."""
    true = observation.body_pose
    if observation.pose_frame < 0:
        return np.full_like(true, np.nan)
    if noise.model is not None:
        at = [noise.camera_streams.at(robot, observation.pose_frame) for robot in range(len(true))]
        return np.array([noise.model.pose(pose, random) for pose, random in zip(true, at, strict=True)])
    seen = true + noise.pose_std * noise.camera_draws.at(observation.pose_frame, partial(_camera_numbers, noise, true))
    if noise.radio is not None:
        for robot in range(len(true)):
            random = noise.radio_streams.at(robot, observation.pose_frame)
            seen[robot, :2] = place_of(measured_ranges(true[robot, :2], noise.radio, random), noise.radio.anchors)
    return seen + np.array(noise.pose_bias) if noise.pose_bias else seen


def _ranges(observation: Observation, noise: SensorNoise) -> np.ndarray:
    """Return (beam robots, beams) noisy ranges [m], NaN where a beam returned nothing."""
    raw = _echoes(observation, noise)
    if observation.scan_frame < 0:
        return np.full_like(raw, np.nan)
    streams, model = noise.beam_streams, noise.model
    if model is not None:
        seen = np.empty_like(raw)
        for row, robot in enumerate(noise.beam_robots):
            random = streams.at(robot, observation.scan_frame)
            seen[row] = model.scan(raw[row], random, noise.range_min, noise.range_max)
        return seen
    if noise.range_bias or noise.beam_bias_std:
        there = (raw >= 0) & (raw < noise.range_max)  # what was hit; a range at the maximum is the sensor's cutoff
        raw = np.where(there, np.maximum(raw + noise.beam_biases(raw.shape[1]), 0.0), raw)
    return reported_scans(raw, noise, noise.beam_draws.at(observation.scan_frame, partial(_beam_numbers, noise, raw)))


def _camera_numbers(noise: SensorNoise, poses: np.ndarray, frame: int) -> np.ndarray:
    """Return standard normal numbers like the poses (n, 3) for a frame of the camera."""
    numbers = np.empty(poses.shape)
    for robot, row in enumerate(numbers):
        noise.camera_streams.at(robot, frame).standard_normal(out=row)
    return numbers


def _beam_numbers(noise: SensorNoise, raw: np.ndarray, frame: int) -> BeamNumbers:
    """Return the random numbers of scans like the ranges (b, beams) in a frame of the beams."""
    streams = noise.beam_streams
    return beam_numbers(raw.shape, noise, (streams.at(robot, frame) for robot in noise.beam_robots))


def _echoes(observation: Observation, noise: SensorNoise) -> np.ndarray:
    """Return (beam robots, beams) true ranges [m] of what beams have an echo of, -1 for nothing."""
    raw, cosines, reflectances = observation.ranges, observation.cosines, observation.reflectances
    if noise.rays > 1:
        raw, which = nearest_in_cones(raw, noise.rays)
        cosines = None if cosines is None else values_of_rays(cosines, which, noise.rays)
        reflectances = None if reflectances is None else values_of_rays(reflectances, which, noise.rays)
    if noise.signal is None or cosines is None or observation.scan_frame < 0:
        return raw
    power = relative_power(raw, cosines, WHITE if reflectances is None else reflectances, noise.signal)
    likely = echo_probability(power, noise.signal)
    chance = np.empty(raw.shape)
    for row, robot in enumerate(noise.beam_robots):
        noise.signal_streams.at(robot, observation.scan_frame).random(out=chance[row])
    return np.where(chance < likely, raw, -1.0)


def _camera_poses(readings: Readings) -> np.ndarray:
    """Return the poses (n, 3) that the camera told last."""
    return readings.body_pose if readings.pose_filter is None else readings.pose_filter.camera


def _filtered(
    observation: Observation,
    previous: Readings | None,
    frame: tuple[np.ndarray, int],
    noise: SensorNoise,
    parameters: FilterParameters,
) -> FilterMemory:
    """Return the filter's memory after this tick: `frame` is the camera's last, its poses (n, 3) and its number."""
    pose, number = frame
    if observation.wheel_angle is None:
        raise ValueError("an observation without wheel angles cannot be filtered")
    angle = encoder_angles(observation.wheel_angle, parameters.step)
    if previous is None or previous.pose_filter is None:
        return initial_memory(pose, angle, parameters)
    memory = driven(previous.pose_filter, angle, observation.time, parameters)
    if number == previous.pose_frame:
        return memory
    exposure_time = min(number * noise.frame_period + noise.timestamp_offset, observation.time)
    return corrected(memory, pose, exposure_time, parameters)
