"""What the sensors add to the truth, and random streams fixed by seed, sensor, robot and frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from pbrg_mj.scenario.schema import Scenario


class Sensor(IntEnum):
    """The noisy sensors; the number is part of the random stream's key, so it must never change."""

    CAMERA = 1
    BEAMS = 2


@dataclass(frozen=True)
class SensorNoise:
    """Noise of all sensors of a run. SI; angles in rad."""

    seed: int
    beam_robots: tuple[int, ...]  # robot of each row of the ranges, from 0, ascending
    position_std: float  # [m]
    heading_std: float  # [rad]
    range_min: float  # [m]
    range_max: float  # [m]
    range_std: float  # [m]
    dropout: float  # probability that a beam returns nothing


def sensor_noise(scenario: Scenario) -> SensorNoise:
    """Return the noise of a scenario's sensors; the ideal plant is seen exactly (range limits still hold)."""
    beams, camera = scenario.sensors.beams, scenario.sensors.camera
    exact = scenario.plant == "ideal"
    return SensorNoise(
        seed=scenario.seed,
        beam_robots=scenario.beam_robots,
        position_std=0.0 if exact else camera.position_std,
        heading_std=0.0 if exact else float(np.deg2rad(camera.heading_std_deg)),
        range_min=beams.range_min,
        range_max=beams.range_max,
        range_std=0.0 if exact else beams.noise_std,
        dropout=0.0 if exact else beams.dropout,
    )


def stream(seed: int, sensor: Sensor, robot: int, frame: int) -> np.random.Generator:
    """Return the random stream of one frame of one robot's sensor.

    Philox counts through 2^256 blocks; robot and frame set the upper half of the counter, so streams never
    overlap, and a frame's noise does not depend on which frames were looked at before.
    """
    key = np.array([seed, sensor], dtype=np.uint64)
    counter = np.array([0, 0, robot, frame], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))
