"""Where everything was between the ticks of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.log.run import TickSeries


@dataclass(frozen=True)
class Motion:
    """Robots over time, free of jumps in angle. Ticks that are not numbers repeat the last one that is."""

    time: np.ndarray  # (T,) [s]
    pose: np.ndarray  # (T, n, 3) x, y [m], heading [rad], unwrapped
    wheel: np.ndarray  # (T, n, 2) left, right [rad] turned since the first tick

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses (n, 3) and the wheels' angles (n, 2) at `time` [s], linear between ticks."""
        return between(self.time, self.pose, time), between(self.time, self.wheel, time)


def motion_of(ticks: TickSeries) -> Motion:
    """Return how the robots truly moved; the wheels' angles are integrals of their logged speeds."""
    pose = held(ticks.body_pose_true)
    pose[..., 2] = np.unwrap(pose[..., 2], axis=0)
    speed = held(ticks.wheel_speed)
    turned = np.diff(ticks.time)[:, None, None] * (speed[1:] + speed[:-1]) / 2
    wheel = np.concatenate([np.zeros_like(speed[:1]), np.cumsum(turned, axis=0)])
    return Motion(ticks.time, pose, wheel)


def between(time: np.ndarray, values: np.ndarray, at: float) -> np.ndarray:
    """Return `values` (T, ...) interpolated at one time; held before the first and after the last of `time` (T,)."""
    k = int(np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 1))
    if k == len(time) - 1 or at <= time[k]:
        return values[k].astype(float)
    share = (at - time[k]) / (time[k + 1] - time[k])
    return (1 - share) * values[k] + share * values[k + 1]


def latest(time: np.ndarray, at: float) -> int:
    """Return the index of the last of `time` (T,) that is not after `at`; -1 before the first."""
    return int(np.searchsorted(time, at + 1e-9, side="right")) - 1


def held(values: np.ndarray) -> np.ndarray:
    """Return a copy of `values` (T, ...) in which what is not finite repeats the last finite value, at first 0."""
    known = np.isfinite(values)
    steps = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(known, steps, 0), axis=0)
    filled = np.take_along_axis(values, last, axis=0)
    return np.where(np.isfinite(filled), filled, 0.0)


def smoothed(values: np.ndarray, ticks: int) -> np.ndarray:
    """Return the running mean of `values` (T, ...) over `ticks` ticks, centred; the ends are held."""
    half = min(ticks // 2, len(values) - 1)
    if half < 1:
        return values
    ends = [np.repeat(values[k : k + 1] if k == 0 else values[-1:], half, axis=0) for k in (0, 1)]
    padded = np.concatenate([np.zeros_like(values[:1]), ends[0], values, ends[1]])
    total = np.cumsum(padded, axis=0)
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
