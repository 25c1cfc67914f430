"""How large a step kappa of an advance the motors can follow, over the whole prediction.

While m is held the velocities are u_j(t) = U_j(t) e, U_j(t) = (row j of eq. 2) A^t; the step kappa of an advance d
adds kappa v_j(t) d with v_j(t) = -U_j(t) (1, 0). Wheels of radius R and largest speed w do

    |u_x| + |u_y| (track / 2) / offset <= R w

in the body's axes: facets that are linear in kappa at a given heading. The heading turns towards the hand point's
velocity, dtheta/dt = |u| sin(beta) / offset with beta between them, so tan(beta / 2) falls by exp(-|u| t / offset): the
headings are predicted along the held plan. A velocity beyond the limit without any advance may not grow; it asks for no
retreat, since walls come first.

Motors do not follow at once, either: with time constant tau a wheel takes up at most R w T / tau in a time T. So an
advance that is held for T may change what is asked for now, v_j(0) d, by a fraction T / tau of what wheels can do. m
then runs where a face gives way, and does not jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid, write_times_error
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.kernel import kernel
from pbrg_mj.world.scene.robot import RobotModel

UNLIMITED = np.zeros((0, 2))  # facets
STILL = 1e-9  # [m/s] slower, a velocity has no direction


@dataclass(frozen=True)
class SpeedLimit:
    """Rows of predicted velocities, and what a robot's wheels can do."""

    time: np.ndarray  # (K,) of the prediction [s]
    U: np.ndarray  # (K * n, N) [1/s]
    v: np.ndarray  # (K * n,) [1/s]
    facets: np.ndarray  # (F, 2) of the polygon of velocities in the body's axes, facet . u <= 1 [s/m]
    offset: float  # of the hand point [m]
    change: np.ndarray  # (C, 2) of the polygon of changes of a velocity by one advance, likewise

    @classmethod
    def of(
        cls, model: TeamModel, grid: PredictionGrid, facets: np.ndarray, offset: float, change: np.ndarray = UNLIMITED
    ) -> SpeedLimit:
        """Return the rows at the grid's ticks: facets (F, 2) of velocities, (C, 2) of changes, offset [m]."""
        ticks, velocities = grid.tick[:-1], [model.after(0, model.rate)]
        for width in np.diff(ticks).tolist():
            velocities.append(model.after(width, velocities[-1]))
        U = np.concatenate(velocities)
        return cls(ticks * model.tick, U, -(U @ model.at_rest), facets, offset, change)

    def kappa(self, error: np.ndarray, heading: np.ndarray, advance: np.ndarray) -> float:
        """Return the largest kappa in [0, 1] for an advance (2,) [m].

        `error` (N, 2) [m] is x - (m, 0) at the held m, N being `TeamModel`'s, `heading` (n,) [rad].
        """
        return speed_kappa(self.rows, error, heading, advance)

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]:
        """What `speed_kappa` takes: time, columns of U (n, N, K), v (n, K), facets, offset, change."""
        points, n = len(self.time), len(self.v) // len(self.time)
        columns = np.ascontiguousarray(self.U.reshape(points, n, -1).transpose(1, 2, 0))
        v = np.ascontiguousarray(self.v.reshape(points, n).T)
        return self.time, columns, v, self.facets, self.offset, self.change


@kernel
def speed_kappa(rows, error, heading, advance):
    """Compute `SpeedLimit.kappa` of `error` (N, 2) [m], `heading` (n,) [rad], `advance` (2,) [m].

    `rows` are `SpeedLimit.rows`: time (K,) [s], columns (n, N, K) of U [1/s], v (n, K) [1/s], facets (F, 2) [s/m], the
    hand point's offset [m], change (C, 2) [s/m].
    """
    time, columns, v, facets, offset, change = rows
    no_advance = advance[0] == 0.0 and advance[1] == 0.0  # m is where it is to go, as in most ticks
    if no_advance or (len(facets) == 0 and len(change) == 0):
        return 1.0
    u = np.empty((2, len(time)))
    n, kappa, length = len(heading), 1.0, math.sqrt(advance[0] ** 2 + advance[1] ** 2)
    slowest = np.inf  # no velocity below this meets a facet at any heading
    for f in range(len(facets)):
        slowest = min(slowest, 1.0 / math.sqrt(facets[f, 0] ** 2 + facets[f, 1] ** 2))
    for j in range(n):
        c, s = math.cos(heading[j]), math.sin(heading[j])
        for f in range(len(change)):
            turned = change[f, 0] * (c * advance[0] + s * advance[1]) + change[f, 1] * (c * advance[1] - s * advance[0])
            if v[j, 0] * turned > 1.0:
                kappa = min(kappa, 1.0 / (v[j, 0] * turned))
        if len(facets) == 0:
            continue
        write_times_error(columns, j, error, u)
        for k in range(_rows_that_may_bind(u, v[j], length, slowest)):
            if k > 0:
                c, s = _turned(c, s, u[0, k - 1], u[1, k - 1], (time[k] - time[k - 1]) / offset)
            ahead, across = c * u[0, k] + s * u[1, k], c * u[1, k] - s * u[0, k]
            more_ahead = v[j, k] * (c * advance[0] + s * advance[1])
            more_across = v[j, k] * (c * advance[1] - s * advance[0])
            for f in range(len(facets)):
                rise = facets[f, 0] * more_ahead + facets[f, 1] * more_across
                if rise > 0.0:
                    slack = 1.0 - (facets[f, 0] * ahead + facets[f, 1] * across)
                    kappa = min(kappa, max(slack, 0.0) / rise)
    return kappa


@kernel
def _rows_that_may_bind(u, v, length, slowest):
    """Return how many rows of a robot there are up to its last one fast enough to meet a facet.

    u (2, K) [m/s] are its velocities without the advance, v (K,) [1/s] those per metre of it, `length` [m] is its
    length and `slowest` [m/s] the speed at which the nearest facet is met.
    """
    count = len(v)
    while count > 0:
        k = count - 1
        if math.sqrt(u[0, k] ** 2 + u[1, k] ** 2) + abs(v[k]) * length > slowest:
            break
        count -= 1
    return count


@kernel
def _turned(c, s, ux, uy, ratio):
    """Return the heading's cosine and sine after a time at velocity u; `ratio` is that time over the offset [s/m]."""
    speed = math.sqrt(ux * ux + uy * uy)
    if speed < STILL:
        return c, s
    dx, dy = ux / speed, uy / speed
    half_angle = (c * dy - s * dx) / max(1.0 + c * dx + s * dy, STILL)  # tan(beta / 2)
    w = half_angle * math.exp(-speed * ratio)
    turn_c, turn_s = (1.0 - w * w) / (1.0 + w * w), 2.0 * w / (1.0 + w * w)
    return dx * turn_c + dy * turn_s, dy * turn_c - dx * turn_s


def wheel_facets(robot: RobotModel) -> np.ndarray:
    """Return the facets (4, 2) of the velocities that a robot's wheels can do against their friction [s/m].

    The motors of an omnidirectional base work each for its own direction: |u_x| <= R w, |u_y| <= R w.
    """
    if robot.omnidirectional:
        return np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]) / (robot.wheel_radius * robot.loaded_speed)
    sideways = robot.track / 2 / robot.hand_offset
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    return signs * [1.0, sideways] / (robot.wheel_radius * robot.loaded_speed)


def turning_offset(robot: RobotModel) -> float:
    """Return the offset by which the heading turns towards the hand point's velocity [m]; inf where it does not."""
    return math.inf if robot.omnidirectional else robot.hand_offset


def disc_facets(limit: float, count: int) -> np.ndarray:
    """Return the facets (count, 2) of the regular polygon inside the disc of radius `limit` [m/s]."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)]) / (limit * np.cos(np.pi / count))
