"""From a robot's body frame to the world, with the uncertainty of its own pose."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.lines import Line
from pbrg_mj.perception.setup import PoseNoise


@dataclass(frozen=True)
class WorldLine:
    """A wall's face n . q = c in the world; the robot that saw it is on the side n . q <= c."""

    angle: float  # direction of the normal n [rad]
    offset: float  # c [m]
    covariance: np.ndarray  # (2, 2) of (angle, offset): range noise and pose noise
    normal: np.ndarray  # (2,) n
    middle: np.ndarray  # (2,) middle of the stretch seen [m]
    length: float  # of the stretch seen [m]
    distance: float  # of the robot's centre from the line [m]


def to_world(line: Line, pose: np.ndarray, pose_noise: PoseNoise) -> WorldLine:
    """Return a line of the body frame in the world, given the body's estimated pose x, y [m], heading [rad]."""
    x, heading = pose[:2], float(pose[2])
    angle = line.angle + heading
    n, t = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    cos, sin = math.cos(heading), math.sin(heading)
    rotation = np.array([[cos, -sin], [sin, cos]])
    # offset = c + n(angle) . x, so the angle's error moves it by t . x and the position's by its part along n.
    lever = np.array([[1.0, 0.0], [float(t @ x), 1.0]])
    inner = line.covariance + np.diag([pose_noise.heading**2, 0.0])
    return WorldLine(
        angle=math.remainder(angle, 2 * math.pi),
        offset=line.offset + float(n @ x),
        covariance=lever @ inner @ lever.T + np.diag([0.0, pose_noise.position**2]),
        normal=n,
        middle=x + rotation @ line.middle,
        length=line.length,
        distance=line.offset,
    )
