"""The points that a robot remembers: one row of `POINT` each, in the world."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

POINT = np.dtype(
    [(name, np.float64) for name in ("x", "y", "std", "pose_std", "time")]
    + [(name, np.int64) for name in ("live", "scan", "binds", "passed")]
)
"""One echo.

- x, y [m]
- std [m]: standard deviation of its range; pose_std [m]: what the robot's position and heading add
- time [s] and scan: when it was seen, by the clock and by the number of the scan
- binds: it is no outlier; passed: scans in which a beam went past it to something behind
"""

PASSES = 2  # scans in which a beam must pass a point before it is gone
HIDDEN = 2  # scans' worth of points that are remembered besides the recent scans'


def no_points(robots: int, beams: int, recent: int) -> np.ndarray:
    """Return the empty memory (robots, M) of POINT."""
    return np.zeros((robots, (recent + HIDDEN) * beams), dtype=POINT)


@kernel
def forget(points, scan, ranges, pose, parameters):
    """Take out of the memory what the scan `ranges` (beams,) [m] shows to be gone, sees anew, or nobody has seen long.

    - A point nearer than the echo of a beam that meets its place is passed; at the second time it is gone. A beam
      without an echo passes nothing: silence is unknown, not free.
    - A point older than the recent scans at a place where there is an echo again is taken over by that echo.
    - A point that is hidden, or outside of what the beams reach, stays until `memory` is over.
    """
    for i in range(len(points)):
        point = points[i]
        if point["live"] == 0:
            continue
        if pose.time - point["time"] > parameters.memory:
            point["live"] = 0
            continue
        if scan - point["scan"] < 1:
            continue
        x, y = point["x"] - pose.x, point["y"] - pose.y
        distance = math.sqrt(x * x + y * y)
        beam, aside = _nearest_beam(math.atan2(y, x) - pose.heading, parameters)
        if beam < 0 or parameters.blocked[beam] or math.isnan(ranges[beam]):
            continue
        noise = 3.0 * math.sqrt(2.0 * point["std"] ** 2 + 2.0 * point["pose_std"] ** 2)
        across = distance * math.sin(min(aside, 0.5 * math.pi))
        if ranges[beam] > distance + noise + 2.0 * across + 0.02:
            if across <= 0.02 + point["std"]:
                point["passed"] += 1
            if point["passed"] >= PASSES:
                point["live"] = 0
        elif abs(ranges[beam] - distance) <= noise + 2.0 * across + 0.02:
            point["passed"] = 0
            if scan - point["scan"] >= parameters.recent:
                point["live"] = 0


@kernel
def _nearest_beam(angle, parameters):
    """Return the beam nearest to a direction in the body frame [rad], -1 for none, and the angle between them."""
    turns = (angle - parameters.first) / (2.0 * math.pi)
    ahead = (turns - math.floor(turns)) * 2.0 * math.pi
    beams = len(parameters.directions)
    beam = math.floor(ahead / parameters.gap + 0.5)
    aside = abs(ahead - beam * parameters.gap)
    if parameters.closed:
        return beam % beams, aside
    if beam < beams:
        return beam, aside
    return (0, 2.0 * math.pi - ahead) if 2.0 * math.pi - ahead < 0.5 * parameters.gap else (-1, aside)


@kernel
def place_for(points, start):
    """Return a free place in the memory from `start` on; without one, that of the oldest point."""
    for i in range(start, len(points)):
        if points[i]["live"] == 0:
            return i
    oldest = 0
    for i in range(len(points)):
        if points[i]["time"] < points[oldest]["time"]:
            oldest = i
    return oldest
