"""Lines nearer than beams tell: a wall beside a robot stays where it was seen, and is one wall."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.scan.extract_lines import extract_lines
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario, beam_angles
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import scenario, setup
from tests.raycast import Scene, cast_along

WALL = Scene(((0.0, -3.0, 0.0, 3.0),))
RATE = {"lidar": 8.0, "lds_02": 5.0}  # of scans; a frame of the camera comes with each [Hz]


def sensing(preset: str) -> Scenario:
    """A robot with such beams, whose scans are taken at once."""
    return scenario(sensors={"beams": {"preset": preset, "scan_time": 0.0}, "camera": {"rate_hz": RATE[preset]}})


def look(noise: SensorNoise, angles: np.ndarray, distance: float, heading: float, frame: int) -> np.ndarray:
    """A scan (1, beams) [m] from so far before the wall, with the sensor's noise."""
    raw = cast_along(WALL, np.array([-distance, 0.0, heading]), angles, noise.range_max)
    ranges = noisy_scan(np.nan_to_num(raw, nan=-1.0), noise, stream(noise.seed, Source.BEAMS, 0, frame))
    return ranges[None]


@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
@pytest.mark.parametrize("distance", [0.145, 0.13, 0.11])
def test_a_wall_in_the_blind_zone_stays(preset: str, distance: float) -> None:
    """A robot comes up to the wall and stays for five seconds: beams straight at it have no echo, and say nothing."""
    given = sensing(preset)
    config, noise, angles = setup(given), sensor_noise(given), beam_angles(given.sensors.beams)
    memory, rate = initial(config), RATE[preset]
    for frame in range(round(10 * rate)):
        away = max(1.2 - 0.25 * frame / rate, distance)
        ranges = look(noise, angles, away, 0.0, frame)
        readings = Readings(np.array([[-away, 0.0, 0.0]]), ranges, True, frame, frame)
        known, memory = perceive(readings, frame / rate, memory, config)
        if frame > 1:
            assert known.active[0].sum() == 1
    assert np.isnan(ranges[0, 0])
    (track,) = memory.tracks[0][memory.tracks[0]["live"] == 1]
    assert track["hits"] > 10 and track["offset"] == pytest.approx(distance, abs=0.01)


@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
def test_both_sides_of_what_is_too_near_are_one_line(preset: str) -> None:
    given = sensing(preset)
    config, noise, angles = setup(given), sensor_noise(given), beam_angles(given.sensors.beams)
    whole = 0
    for frame in range(60):
        ranges = look(noise, angles, 0.13, 0.1 * frame, frame)[0]
        lines = extract_lines(ranges, config.directions, config.line_params)
        assert not lines.free_low.any() and not lines.free_high.any()
        whole += len(lines) == 1 and lines.low[0] < -0.5 and lines.high[0] > 0.5
    assert whole >= 55  # now and then noise bends one side
