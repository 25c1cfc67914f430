"""What a tick sees, concludes and hands to the next."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.governor.problem.lazy_rows import LazyRows
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.team.exchange import ExchangeMemory


class PoseEstimate(NamedTuple):
    """Where the robots take themselves to be, by poses as they were read."""

    body_pose: np.ndarray  # (n, 3) x, y [m], heading [rad]
    hand_world: np.ndarray  # (n, 2) q [m]
    p: np.ndarray  # (n, 2) q - b [m]
    heading: np.ndarray  # (n,) of body_pose


class LoopState(NamedTuple):
    """What one tick hands to the next, besides the world."""

    readings: Readings | None  # None before the first tick
    estimator: Any  # its memory
    half_spaces: HalfSpaces | None  # None before the first tick
    rows: Rows | LazyRows | None  # of the half-spaces known then; likewise None before the first tick
    pose: PoseEstimate | None  # likewise
    governor: Any  # likewise
    m: np.ndarray | None  # (n, 2) governed references [m]; likewise
    xi: np.ndarray  # (n, 2) [m]
    displacement: np.ndarray | None  # (n, 2) of q from p + b [m]; None where robots keep no distance
    exchange: ExchangeMemory | None = None  # of the pre-stabiliser's messages; None: before the first, or at once
    motion: np.ndarray | None = None  # (n, 1 + d, 2) of `vehicle.motor_lag` [m]; None where nobody asks for it


class SensedTick(NamedTuple):
    """What the robots saw in one tick."""

    index: int  # pyright: ignore[reportIncompatibleMethodOverride] - not the one of tuples
    time: float  # [s]
    readings: Readings
    estimator: Any  # its memory after this tick
    half_spaces: HalfSpaces
    pose: PoseEstimate
    p: np.ndarray  # (n, 2) of the governor's problem: q - b less the displacement [m]
    timestamps: tuple[float, float, float]  # wall clock before sensing, and after sensing and perception [s]


class ControlTick(NamedTuple):
    """What the robots saw, concluded and commanded in one tick."""

    index: int  # pyright: ignore[reportIncompatibleMethodOverride] - not the one of tuples
    time: float  # [s]
    readings: Readings
    hand_world: np.ndarray  # (n, 2) q as estimated from the readings [m]
    half_spaces: HalfSpaces
    problem: Problem
    solution: Solution
    memory: Any  # the governor's, after its step
    displacement: np.ndarray | None  # (n, 2) of q from p + b [m]; None where robots keep no distance
    velocity: np.ndarray  # (n, 2) u of eq. 2, as velocity filters leave it [m/s]
    command: np.ndarray  # (n, 2) wheel voltages [V] or speeds [rad/s]; u [m/s] in the ideal plant
    timestamps: tuple[float, ...]  # wall clock before sensing, and after sensing, perception, governor, control [s]


class ExternalCommand(NamedTuple):
    """Commands to the robots from outside; None: the operator's r, the velocities of eq. 2."""

    reference: np.ndarray | None = None  # (2,) in place of the operator's r [m]
    velocity: np.ndarray | None = None  # (n, 2) in place of u of eq. 2, before velocity filters [m/s]
