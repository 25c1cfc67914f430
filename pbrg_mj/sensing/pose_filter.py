"""Poses from wheel encoders and an overhead camera: an extended Kalman filter a robot, for frames rare, late or wrong.

With d_l, d_r the travel of the wheels, d_s their mean and d_t = (d_r - d_l) / track, a step is

    x += d_s cos(theta + d_t / 2),   y += d_s sin(theta + d_t / 2),   theta += d_t

with the variance slip |d| on each wheel's travel (Siegwart and Nourbakhsh, "Introduction to Autonomous Mobile Robots",
section 5.2.4). A camera frame that is late corrects the estimate at its exposure, and the steps since then are taken
again. A frame whose innovation is beyond the GATE is not believed: the camera may have lost the robot, or taken it for
another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

GATE = 16.27  # chi-squared with 3 degrees exceeds it once in 1,000
MAX_REJECTED_FRAMES = 10  # frames in a row that are not believed; the next one is, whatever it says


class FilterParameters(NamedTuple):
    """What the filter assumes."""

    track: float  # between the wheels [m]
    wheel_radius: float  # [m]
    step: float  # of the encoders [rad]
    slip: float  # variance of a wheel's travel per metre [m]
    position_std: float  # of the camera [m]
    heading_std: float  # [rad]


class Estimate(NamedTuple):
    """Poses of all robots."""

    pose: np.ndarray  # (n, 3) x, y [m], heading [rad]
    covariance: np.ndarray  # (n, 3, 3)


@dataclass(frozen=True)
class FilterMemory:
    """Estimates at the last frame's exposure and now, and the travel of the wheels since that exposure."""

    at_exposure: Estimate
    now: Estimate
    travel: tuple[tuple[float, np.ndarray], ...]  # (time [s], (n, 2) travel until then since the entry before [m])
    angle: np.ndarray  # (n, 2) of the wheels, in whole steps [rad]
    camera: np.ndarray  # (n, 3) poses of the last frame
    rejected: np.ndarray  # (n,) frames in a row that were not believed


def encoder_angles(angle: np.ndarray, step: float) -> np.ndarray:
    """Return what encoders read of wheel angles [rad]: the whole steps passed."""
    return np.floor(angle / step) * step


def initial_memory(pose: np.ndarray, angle: np.ndarray, parameters: FilterParameters) -> FilterMemory:
    """Return the memory of robots whose camera poses (n, 3) are the first, and encoders read `angle` (n, 2) [rad]."""
    spread = np.diag([parameters.position_std**2, parameters.position_std**2, parameters.heading_std**2])
    first = Estimate(pose.copy(), np.tile(spread, (len(pose), 1, 1)))
    return FilterMemory(first, first, (), angle, pose, np.zeros(len(pose), dtype=int))


def driven(memory: FilterMemory, angle: np.ndarray, time: float, parameters: FilterParameters) -> FilterMemory:
    """Return the memory at a later `time` [s], when the encoders read `angle` (n, 2) [rad]."""
    travel = parameters.wheel_radius * (angle - memory.angle)
    now = predicted(memory.now, travel, parameters)
    return replace(memory, now=now, travel=(*memory.travel, (time, travel)), angle=angle)


def corrected(memory: FilterMemory, pose: np.ndarray, exposure: float, parameters: FilterParameters) -> FilterMemory:
    """Return the memory after a frame with the poses (n, 3), exposed at a time [s] after the last one's."""
    before = [travel for time, travel in memory.travel if time <= exposure + 1e-9]
    after = memory.travel[len(before) :]
    at = memory.at_exposure
    for travel in before:
        at = predicted(at, travel, parameters)
    at, rejected = _updated(at, pose, memory.rejected, parameters)
    now = at
    for _, travel in after:
        now = predicted(now, travel, parameters)
    return replace(memory, at_exposure=at, now=now, travel=after, camera=pose, rejected=rejected)


def predicted(at: Estimate, travel: np.ndarray, parameters: FilterParameters) -> Estimate:
    """Return the estimate after the wheels' travel (n, 2) left, right [m]."""
    forth, turn = travel.mean(axis=1), (travel[:, 1] - travel[:, 0]) / parameters.track
    middle = at.pose[:, 2] + 0.5 * turn
    c, s, zero, one = np.cos(middle), np.sin(middle), np.zeros(len(turn)), np.ones(len(turn))
    pose = at.pose + np.column_stack([forth * c, forth * s, turn])
    F = _matrices([[one, zero, -forth * s], [zero, one, forth * c], [zero, zero, one]])
    b = 0.5 * forth / parameters.track
    along_x, along_y = [0.5 * c + b * s, 0.5 * c - b * s], [0.5 * s - b * c, 0.5 * s + b * c]
    B = _matrices([along_x, along_y, [-one / parameters.track, one / parameters.track]])
    # A step of the encoder falls anywhere in a tick: half of one is in doubt at either end of a travel.
    quantum = (parameters.wheel_radius * parameters.step) ** 2 / 6.0
    variance = np.where(travel != 0.0, parameters.slip * np.abs(travel) + quantum, 0.0)
    return Estimate(pose, F @ at.covariance @ _turned(F) + (B * variance[:, None, :]) @ _turned(B))


def _updated(
    at: Estimate, pose: np.ndarray, rejected: np.ndarray, parameters: FilterParameters
) -> tuple[Estimate, np.ndarray]:
    R = np.diag([parameters.position_std**2, parameters.position_std**2, parameters.heading_std**2])
    innovation = pose - at.pose
    innovation[:, 2] = np.angle(np.exp(1j * innovation[:, 2]))
    S = at.covariance + R
    gain = at.covariance @ np.linalg.inv(S)
    square = np.einsum("ni,nij,nj->n", innovation, np.linalg.inv(S), innovation)
    lost = (square > GATE) & (rejected >= MAX_REJECTED_FRAMES)
    believed = (square <= GATE) | lost
    moved = at.pose + np.einsum("nij,nj->ni", gain, innovation)
    moved[lost] = pose[lost]
    keep = np.eye(3) - gain
    P = keep @ at.covariance @ _turned(keep) + gain @ R @ _turned(gain)  # Joseph's form
    P[lost] = R
    chosen = Estimate(np.where(believed[:, None], moved, at.pose), np.where(believed[:, None, None], P, at.covariance))
    return chosen, np.where(believed, 0, rejected + 1)


def _matrices(rows: list[list[np.ndarray]]) -> np.ndarray:
    """Return (n, r, c) of entries (n,)."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _turned(matrices: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrices, -1, -2)
