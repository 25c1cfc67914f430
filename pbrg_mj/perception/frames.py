"""Where a robot was when it scanned, and how well it knows that.

Assumed of the pose estimate: unbiased noise, independent from camera frame to camera frame and the same for all lines
of a scan. Several scans that share a camera frame share its error, so each counts as that much worse: together they
weigh as one. A pose older than the scan is carried on at the speed since the last scan; half of that way counts as
one more standard deviation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.noise import sensor_noise

LONGEST = 0.5  # [s] speeds are not taken over longer gaps


@dataclass(frozen=True)
class PoseModel:
    """Noise and clock of a robot's own pose estimate."""

    position_var: float  # of one scan's pose, along each axis [m^2]
    heading_var: float  # [rad^2]
    frame_period: float  # of the camera [s]
    scan_period: float  # of the beams [s]


@dataclass(frozen=True)
class Stand:
    """Where a robot stood at its last scan."""

    place: np.ndarray  # (2,) x, y at the scan, the tracks' anchor [m]
    estimate: np.ndarray  # (3,) the camera's x, y [m], heading [rad]
    exposed: float  # when that was true [s]
    time: float  # of the scan [s]


@dataclass(frozen=True)
class ScanPose:
    """A robot's pose at its scan."""

    pose: tuple[float, float, float]  # x, y [m], heading [rad]
    position_var: float  # [m^2]
    heading_var: float  # [rad^2]
    shift: tuple[float, float]  # since the last scan [m]
    time: float  # [s]
    elapsed: float  # since the last scan [s]


def pose_model(scenario: Scenario) -> PoseModel:
    """Return the pose model for a scenario."""
    noise, step = sensor_noise(scenario), scenario.timing.physics_step
    camera, beams = scenario.sensors.camera, scenario.sensors.beams
    frame, scan = max(1 / camera.rate_hz, step), max(1 / beams.rate_hz, step)
    shared = max(1.0, frame / scan)
    return PoseModel(shared * noise.position_std**2, shared * noise.heading_std**2, frame, scan)


def stand(
    estimate: np.ndarray, frames: tuple[int, int], time: float, last: Stand | None, model: PoseModel
) -> ScanPose:
    """Return the pose at a scan from the `estimate` (3,) of the camera; `frames` are of camera and scan."""
    exposed = frames[0] * model.frame_period
    age = min(max(frames[1] * model.scan_period - exposed, 0.0), LONGEST)
    x, y, heading = estimate.tolist()
    position_var, heading_var = model.position_var, model.heading_var
    gap = exposed - last.exposed if last is not None else 0.0
    if last is not None and age > 1e-6 and 0 < gap <= LONGEST:
        ratio = age / gap
        dx, dy = ratio * (x - float(last.estimate[0])), ratio * (y - float(last.estimate[1]))
        turn = ratio * math.remainder(heading - float(last.estimate[2]), 2 * math.pi)
        x, y, heading = x + dx, y + dy, heading + turn
        position_var = (1 + 2 * ratio**2) * position_var + 0.25 * (dx**2 + dy**2)
        heading_var = (1 + 2 * ratio**2) * heading_var + 0.25 * turn**2
    shift = (x - float(last.place[0]), y - float(last.place[1])) if last is not None else (0.0, 0.0)
    elapsed = time - last.time if last is not None else 0.0
    return ScanPose((x, y, heading), position_var, heading_var, shift, time, elapsed)


def stood(pose: ScanPose, estimate: np.ndarray, frame: int, model: PoseModel) -> Stand:
    """Return what to remember of a scan's pose."""
    return Stand(np.array(pose.pose[:2]), estimate.copy(), frame * model.frame_period, pose.time)
