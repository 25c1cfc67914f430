"""What every plant offers to the loop: observe, advance, truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np


class Observation(NamedTuple):
    """Raw, noise-free readings as the sensors hold them at the start of a tick.

    A frame number grows by one with every new sample; between samples the reading is held.
    """

    body_pose: np.ndarray  # (n, 3) x, y [m], heading [rad] of each body in the world
    pose_frame: int
    ranges: np.ndarray  # (beam robots, rays of all beams) [m]; -1 where nothing was hit
    scan_frame: int
    time: float = 0.0  # [s]
    wheel_angle: np.ndarray | None = None  # (n, 2) left, right at this time [rad]; None where nobody asks
    cosines: np.ndarray | None = None  # of the rays' angles of incidence, like `ranges`; None where nobody asks
    reflectances: np.ndarray | None = None  # of what rays meet, like `ranges`; None where all is white or nobody asks


class Truth(NamedTuple):
    """Ground truth for the record. Nothing downstream of the sensors may see it."""

    body_pose: np.ndarray  # (n, 3) x, y [m], heading [rad]
    hand_world: np.ndarray  # (n, 2) q [m]
    wheel_speed: np.ndarray  # (n, 2) left, right [rad/s]; zeros in the ideal plant
    wall_margin: np.ndarray  # (n,) distance of the hand point to the nearest wall's face, less the clearance [m]
    wall_contact: np.ndarray  # (n,) bool: some part of the robot touched a wall since the previous tick
    moving_margin: np.ndarray  # (n,) the same as wall_margin, to the nearest moving box where it is now [m]
    moving_contact: np.ndarray  # (n,) bool: some part of the robot touched a moving box since the previous tick
    robot_contact: np.ndarray  # (n,) bool: the robot touched another one since the previous tick


TruthSample = tuple[float, Any]
"""Time [s], and what a plant needs of its state then to tell the truth later."""


class Plant(Protocol):
    """A plant. Time moves only in `advance`."""

    @property
    def model_xml(self) -> str:
        """MJCF that compiles to this very world; empty when it is not a MuJoCo world."""
        ...

    def observe(self) -> Observation:
        """Return the sensors' readings now."""
        ...

    def truth(self) -> Truth:
        """Return the ground truth now."""
        ...

    def sample_truth(self) -> TruthSample:
        """Return what the truth of now is made of, which costs less between two ticks than to make it."""
        ...

    def truths(self, samples: Sequence[TruthSample]) -> list[Truth]:
        """Return the truth at each of one sample or more of this plant, now or later."""
        ...

    def advance(self, command: np.ndarray) -> None:
        """Hold `command` (n, 2) over one tick: wheel voltages [V] or speeds [rad/s], or velocities [m/s] if ideal."""
        ...
