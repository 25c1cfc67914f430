"""Eq. 9 behind the motors' lag and a delay: one coordinate of the team, sampled, as a linear map.

The state is x = (y, xi, w, s d_1, ..., s d_d) in R^N, N = n (3 + d), in blocks of n numbers: `problem.motion` says what
they are, s is its weight. The positions that commands of now follow from are known = y - w - d_1 - ... - d_d, and so

    u = -(L + alpha_r D) known + L xi + alpha_r delta m,    xi+ = xi - h L (known + leak xi),    y+ = y + h u,

with w and d_1 as in `vehicle.motor_lag` and the displacements handed on. In y a lag of motors alone is an oscillator
without energy of its own, so that ||x|| hardly grows; in (p, tau v) it would grow to about sqrt(2).
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.problem.motion import displacement_weight
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import continuous_map
from pbrg_mj.vehicle.motor_lag import MotorLag


def motor_maps(team: Network, control: Control, lag: MotorLag) -> tuple[np.ndarray, np.ndarray]:
    """Return the map (N, N) of the state from tick to tick under m = 0, and the velocities u (n, N) of it [1/s]."""
    n, kinematic, weight = team.robots, continuous_map(team, control), displacement_weight(lag.delay)
    blocks = np.eye(n * (3 + lag.delay)).reshape(3 + lag.delay, n, -1)  # rows that give y, xi, w and s d of the state
    known = blocks[0] - blocks[2]
    for weighted in blocks[3:]:
        known = known - weighted / weight
    rates = kinematic @ np.concatenate([known, blocks[1]])
    u, step = rates[:n], np.empty_like(blocks)
    step[0], step[1] = blocks[0] + lag.tick * u, blocks[1] + lag.tick * rates[n:]
    step[2] = lag.remaining * blocks[2] + lag.rolled * u
    if lag.delay:
        step[3] = weight * ((1.0 - lag.remaining) * blocks[2] + (lag.tick - lag.rolled) * u)
        step[4:] = blocks[3:-1]
    return step.reshape(-1, step.shape[-1]), u
