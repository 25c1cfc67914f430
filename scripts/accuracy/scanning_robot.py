"""One robot that scans scenes again and again, with the noise of the sensing package."""

from __future__ import annotations

import numpy as np
from raycast import Scene, cast_along, wheels

from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.setup import PerceptionSetup, perception_setup
from pbrg_mj.perception.track.records import error_covariance
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario, ray_angles
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.cone import nearest_in_cones
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings

SENSORS = ("ideal", "generic", "robotarium", "tof_ring", "lidar")  # presets whose scans are rays, taken at once
OTHERS = ("lds_02", "tof_cones")  # one takes time for a scan, one has cones
CLEARANCE, HAND = 0.1, 0.04  # [m]


PLATES, LOW = 0.049, 0.03  # heights of beams [m]: half the plates', and where wheels are still 35 mm long


def scenario(sensor: str, seed: int = 0, height: float = PLATES, **estimator: object) -> Scenario:
    """A robot by itself with one of SENSORS or OTHERS; every sensor has noise of its own, whatever the seed."""
    given = {
        "seed": _seed(sensor, seed),
        "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
        "operator": {"reference": (0, 0)},
        "sensors": {"beams": {"preset": sensor, "height": height}},
        "estimator": estimator,
    }
    return Scenario.model_validate(given)


def _seed(sensor: str, seed: int) -> int:
    if sensor in SENSORS:
        return seed * len(SENSORS) + SENSORS.index(sensor)
    return 10**7 + seed * len(OTHERS) + OTHERS.index(sensor)


class ScanningRobot:
    """A robot with a sensor, and what it has made of its scans so far; nothing moves while it scans."""

    def __init__(self, given: Scenario) -> None:
        self.setup, self.noise = perception_setup(given, CLEARANCE, HAND), sensor_noise(given)
        beams = given.sensors.beams
        self.angles, self.period, self.height = ray_angles(beams), 1 / beams.rate_hz, beams.height
        self.memory: PerceptionMemory = initial(self.setup)
        self.frame = 0
        self.camera_rate = given.sensors.camera.rate_hz
        self.frames = round(self.camera_rate * beams.scan_time) or 1  # of the camera in a scan

    def scan(self, scene: Scene, pose: np.ndarray) -> None:
        """Scan a scene from a true pose (3,); low beams see the own wheels too."""
        seen = scene + wheels(pose, self.height)
        raw = np.nan_to_num(cast_along(seen, pose, self.angles, self.noise.range_max), nan=-1.0)
        nearest, _ = nearest_in_cones(raw[None], self.noise.rays)
        ranges = noisy_scan(nearest[0], self.noise, stream(self.noise.seed, Source.BEAMS, 0, self.frame))
        if self.frames == 1:
            self._tell(Readings(self._seen(pose, self.frame)[None], ranges[None], True, 0, 0), self.frame * self.period)
        else:  # the scan goes on from one frame of the camera to another, and each has noise of its own
            for number in range(self.frame * self.frames + 1, (self.frame + 1) * self.frames + 1):
                new, seen = number == (self.frame + 1) * self.frames, self._seen(pose, number)
                readings = Readings(seen[None], ranges[None], new, number, self.frame + new)
                self._tell(readings, number / self.camera_rate)
        self.frame += 1

    def _seen(self, pose: np.ndarray, number: int) -> np.ndarray:
        draw = stream(self.noise.seed, Source.CAMERA, 0, number).standard_normal(3)
        return pose + draw * [self.noise.position_std, self.noise.position_std, self.noise.heading_std]

    def _tell(self, readings: Readings, time: float) -> None:
        _, self.memory = perceive(readings, time, self.memory, self.setup)

    @property
    def tracks(self) -> np.ndarray:
        """What is followed, walls or not."""
        tracks = self.memory.tracks[0]
        return tracks[tracks["live"] == 1]

    def binds(self) -> bool:
        return bool(self.memory.half_spaces.active[0].any())

    def errors(self, track: np.void, normal: np.ndarray, offset: float) -> tuple[float, float, float]:
        """Error of a track's angle [rad] and offset [m] about its anchor, and the normalised error squared."""
        anchor = np.array([self.memory.anchors[0]["x"], self.memory.anchors[0]["y"]])
        turn = track["angle"] - np.arctan2(normal[1], normal[0])
        error = np.array([np.angle(np.exp(1j * turn)), track["offset"] - (offset - normal @ anchor)])
        return float(error[0]), float(error[1]), normalised(error, track, self.setup)


def normalised(error: np.ndarray, track: np.void, setup: PerceptionSetup) -> float:
    """The normalised error squared of a track's (angle, offset), by the covariance that margins count."""
    aa, ac, cc = error_covariance(track, setup.parameters.track)
    return float(error @ np.linalg.solve(np.array([[aa, ac], [ac, cc]]), error))
