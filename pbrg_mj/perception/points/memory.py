"""The points that a robot remembers: one row of `POINT` each, in the world."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

POINT = np.dtype(
    [(name, np.float64) for name in ("x", "y", "std", "pose_std", "bulge", "time")]
    + [(name, np.int64) for name in ("scan", "passed")]
    + [(name, np.bool_) for name in ("live", "binds")],
    align=True,
)
"""One echo.

- x, y [m]
- std [m]: standard deviation of its range; pose_std [m]: what the robot's position and heading add
- bulge [m]: how far a right-angled corner between its beam and the next may stick out
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
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    for i in range(len(points)):
        point = points[i]
        if not point["live"]:
            continue
        if pose.time - point["time"] > parameters.memory:
            point["live"] = False
            continue
        x, y = point["x"] - pose.x, point["y"] - pose.y
        x, y = cos * x + sin * y, cos * y - sin * x
        beam = _nearest_beam(x, y, parameters)
        if beam < 0 or parameters.blocked[beam] or math.isnan(ranges[beam]):
            continue
        dx, dy = parameters.directions[beam, 0], parameters.directions[beam, 1]
        distance, across = math.sqrt(x * x + y * y), abs(dx * y - dy * x)
        tolerance = 3.0 * math.sqrt(2.0 * (point["std"] ** 2 + point["pose_std"] ** 2)) + 2.0 * across + 0.02
        if ranges[beam] > distance + tolerance:
            if across <= 0.02 + point["std"]:
                point["passed"] += 1
            if point["passed"] >= PASSES:
                point["live"] = False
        elif abs(ranges[beam] - distance) <= tolerance:
            point["passed"] = 0
            if scan - point["scan"] >= parameters.recent:
                point["live"] = False


@kernel
def _nearest_beam(x, y, parameters):
    """Return the beam nearest to the direction of (x, y) in the body frame, -1 for none within half a gap."""
    turns = (math.atan2(y, x) - parameters.first) / (2.0 * math.pi)
    ahead = (turns - math.floor(turns)) * 2.0 * math.pi / parameters.gap
    beams = len(parameters.directions)
    beam = math.floor(ahead + 0.5)
    if parameters.closed:
        return beam % beams
    if beam < beams:
        return beam
    return 0 if 2.0 * math.pi / parameters.gap - ahead < 0.5 else -1


@kernel
def place_for(points, start):
    """Return a free place in the memory from `start` on; without one, that of the oldest point."""
    for i in range(start, len(points)):
        if not points[i]["live"]:
            return i
    oldest = 0
    for i in range(len(points)):
        if points[i]["time"] < points[oldest]["time"]:
            oldest = i
    return oldest
