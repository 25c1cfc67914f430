"""Self-occlusion: the beams that a robot's own wheels stop.

They start below the wheels' tops and go out to the sides.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.scenario.robots import RobotName
from pbrg_mj.scenario.schema import Beams, beam_angles

# The wheels of models/robot.xml; a test holds the two together.
RADIUS = 0.02  # [m]
INNER = 0.045  # of a wheel's inner face from the body's centre, where beams start [m]
MARGIN = 1e-4  # [m] along a wheel: nothing hangs on the last bit


def blocked_beams(beams: Beams, robot: RobotName = "generic") -> np.ndarray:
    """Return (count,) bool: the beam can only meet a wheel of its own robot, whatever it reads.

    Other robots than the generic one have their beams above their wheels.
    At a height z a wheel is a chord of 2 sqrt(R^2 - (z - R)^2), abreast of the beams' start.
    """
    if beams.height > 2 * RADIUS or robot != "generic":
        return np.zeros(beams.count, dtype=bool)
    angle, above = beam_angles(beams), beams.height - RADIUS
    reach = math.sqrt(max(RADIUS**2 - above**2, 0.0)) + MARGIN
    return INNER * np.abs(np.cos(angle)) <= reach * np.abs(np.sin(angle))
