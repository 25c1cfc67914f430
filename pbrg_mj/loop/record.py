"""Everything one tick produced, in one frozen record."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.monitor.diagnostics import Diagnostics
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.plant.interface import Truth


class Timings(NamedTuple):
    """Wall-clock seconds of the tick's stages. The one part of a record that is not reproducible."""

    sense: float
    perceive: float
    govern: float
    control: float
    advance: float
    certify: float
    reference_build: float
    reference_solve: float
    reference_balance: float


class TickRecord(NamedTuple):
    """State at the start of tick `index`, and what was decided and applied in it."""

    index: int  # pyright: ignore[reportIncompatibleMethodOverride] - not the one of tuples
    time: float  # [s]
    truth: Truth
    readings: Readings
    hand_world: np.ndarray  # (n, 2) q as estimated from the readings [m]
    half_spaces: HalfSpaces
    problem: Problem
    solution: Solution
    operation: Diagnostics
    flow_passivity: Passivity  # of the flow's own velocity
    optimum: Optimum | None  # at reference ticks
    passivity: Passivity | None  # about the optimum, at reference ticks
    velocity: np.ndarray  # (n, 2) u of eq. 2, as velocity filters leave it [m/s]
    command: np.ndarray  # (n, 2) what the plant was given: wheel voltages [V] or speeds [rad/s]; u [m/s] if ideal
    winding_up: np.ndarray  # (n,) bool: whose xi grows although its wheels do not follow u
    timings: Timings
