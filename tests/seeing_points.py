"""The point estimator run without a plant: scenes are ray-cast with any sensor, and `sensing` adds its noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario, beam_angles
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.scene.robot import load_robot_model
from tests.perceiving import scenario
from tests.raycast import Scene, cast_along

ROBOT = load_robot_model()
PERIOD = 0.1  # [s]


def estimator(
    sensors: dict | None = None, formation=((0.0, 0.0),), slots: int = 6, **keys: Any
) -> tuple[PointEstimator, Scenario]:
    given = scenario(
        formation, sensors=sensors or {}, estimator={"source": "points", "half_spaces_per_robot": slots, **keys}
    )
    robots = np.array(given.beam_robots, dtype=np.int64)
    made = PointEstimator(point_parameters(given, ROBOT), robots, np.array(formation, dtype=float), slots)
    return made, given


def sensor(preset: str) -> dict:
    return {} if preset == "default" else {"beams": {"preset": preset}}


def scan(given: Scenario, scenes: Scene | list[Scene], poses: np.ndarray, frame: int) -> Readings:
    """What robots read at true poses (n, 3), each in a scene of its own; a frame of the camera comes with the scan."""
    noise, beams = sensor_noise(given), given.sensors.beams
    read, seen = [], []
    scenes = scenes if isinstance(scenes, list) else [scenes] * len(poses)
    for robot, (scene, pose) in enumerate(zip(scenes, poses, strict=True)):
        raw = np.nan_to_num(cast_along(scene, pose, beam_angles(beams), beams.range_max), nan=-1.0)
        raw[raw < beams.range_min] = -1.0
        read.append(noisy_scan(raw, noise, stream(noise.seed, Source.BEAMS, robot, frame)))
        draw = stream(noise.seed, Source.CAMERA, robot, frame).standard_normal(3)
        seen.append(pose + draw * [noise.position_std, noise.position_std, noise.heading_std])
    pose_frame = math.ceil(frame * given.sensors.camera.rate_hz / beams.rate_hz - 1e-9)
    return Readings(np.array(seen), np.array(read), True, pose_frame, frame)
