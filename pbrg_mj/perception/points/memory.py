"""The points that a robot remembers: one row of `POINT` each, in the world."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import layout, nearest_beam, nearest_from, next_beam, roughly_ahead

POINT = np.dtype(
    [(name, np.float64) for name in ("x", "y", "std", "pose_std", "time")]
    + [(name, np.float32) for name in ("ux", "uy", "turn_std", "protrusion", "along_x", "along_y", "slack")]
    + [(name, np.float32) for name in ("confirmed_within", "vx", "vy")]
    + [(name, np.int32) for name in ("scan", "passed", "beam")]
    + [(name, np.bool_) for name in ("live", "binds")],
    align=True,
)
"""One echo.

- x, y [m]
- std [m]: standard deviation of its range; pose_std [m]: what the robot's position and heading add
- time [s] and scan: when it was seen, by the clock and by the number of the scan
- ux, uy: direction of its beam; turn_std [m]: what the heading adds, across it
- protrusion [m]: how far a right-angled corner between its beam and the next may stick out in any direction; and in the
  direction g: by no more than |g . along| + slack, along [m] the way on its face to the next beam
- vx, vy [m/s]: of what it is of, where it may move nearer than beams tell (blind_zone_points.py)
- beam: of the newest scan, in the point's direction, with an echo that may be on its face; -1: none
- binds: it is no outlier
- confirmed_within [m]: how far from it was the nearest echo of another scan that told so; infinite where none did
- passed: how beams went past it to something behind: bits `PASSED_LEFT`, `PASSED_RIGHT`, plus `THROUGH` for each scan
"""

PASSED_LEFT, PASSED_RIGHT, THROUGH = 1, 2, 4
NEAR = 0.02  # [m] beams that pass a point no farther than this from it tell whether it is gone
MOST_BESIDE = 16  # beams to either side of a point's direction that may tell of its place
LEAST_CAPACITY = 576  # points, as of 72 beams: few of 24 beams see again what the scans before saw
HIDDEN = 2  # scans' worth of points that are remembered besides the recent scans'


def no_points(robots: int, capacity: int) -> np.ndarray:
    """Return the empty memory (robots, capacity) of POINT."""
    return np.zeros((robots, capacity), dtype=POINT)


def capacity_after(used: int, beams: int, recent: int) -> int:
    """Return the capacity that one more scan needs where the first `used` places are in use."""
    return min(used + beams, max((recent + HIDDEN) * beams, LEAST_CAPACITY))


@kernel
def copy_records(before, count, after):
    """Copy the first `count` records of before (M,) to after (M,), each at once.

    NumPy copies them field by field, which takes ten times as long.
    """
    for i in range(count):
        after[i] = before[i]


@kernel
def write_point(point, place, direction, stds, seen):
    """Write a point that binds, which rests and no other echo confirms, and of which no corner sticks out.

    `place` (2,) [m], `direction` (2,) of its beam, `stds` std, pose_std, turn_std [m], `seen` (2,) time [s] and scan.
    """
    point["x"], point["y"], point["ux"], point["uy"] = place[0], place[1], direction[0], direction[1]
    point["std"], point["pose_std"], point["turn_std"] = stds
    point["time"], point["scan"], point["beam"], point["passed"] = seen[0], seen[1], -1, 0
    point["protrusion"], point["slack"], point["along_x"], point["along_y"] = 0.0, 0.0, 0.0, 0.0
    point["vx"], point["vy"], point["confirmed_within"] = 0.0, 0.0, math.inf
    point["live"], point["binds"] = True, True


@kernel
def slots_used(points):
    """Return how many places there are up to the last one in use."""
    used = len(points)
    while used > 0 and not points[used - 1]["live"]:
        used -= 1
    return used


@kernel
def delete_stale(points, scan, beams, pose, parameters):
    """Take out of the memory what a scan, `beams`, shows to be gone or nobody has seen long; tell what it sees again.

    - A point nearer than the echo of a beam that goes by it is passed, on that side. It is gone when beams have passed
      it on both sides, or in two scans where its own beam went, as far as poses tell: a thing that is still there, with
      the point on its face, stops the beams on one side of it, however often those on the other go past its edge. A
      beam without an echo passes nothing: silence is unknown, not free.
    - A point older than the recent scans whose beam has no echo is that of a beam beside it, if in two scans one has an
      echo where the point may be as badly as its pose was known: what a turning robot saw lies beside the thing.
    - The beam of a point is the one that goes to its direction, if its echo may be on the point's face, else -1.
    - A point that is hidden, or farther than the beams reach, stays until `memory` is over.
    - One nearer than the shortest range that beams tell stays until beams pass it or the robot has gone away: there its
      own beam is silent because it is so near, whatever those beside it see of its thing.
    """
    ranges, directions = beams
    even, (xs, ys, ahead) = layout(parameters), _in_body_frame(points, pose, parameters)
    for i in range(len(points)):
        point = points[i]
        if not point["live"]:
            continue
        x, y = xs[i], ys[i]
        in_blind_zone = x * x + y * y <= blind_zone_radius(point, parameters) ** 2
        if pose.time - point["time"] > parameters.memory and not in_blind_zone:
            point["live"] = False
            continue
        point["beam"] = -1
        beam = nearest_beam(x, y, ahead[i], even)
        if parameters.scan_time > 0.0 and beam >= 0:
            beam = nearest_from(beam, x, y, directions, parameters)
        if beam < 0 or parameters.blocked[beam]:
            continue
        if math.isnan(ranges[beam]):
            if in_blind_zone or scan - point["scan"] < parameters.recent:
                continue
            if _is_seen_beside(point, (x, y), beam, beams, parameters):
                point["passed"] += THROUGH
                point["live"] = point["passed"] < 2 * THROUGH
            continue
        dx, dy = directions[beam, 0], directions[beam, 1]
        distance, across = math.sqrt(x * x + y * y), dx * y - dy * x  # across: positive where it lies to the left
        tolerance = 3.0 * math.sqrt(2.0 * (point["std"] ** 2 + point["pose_std"] ** 2)) + 2.0 * abs(across) + 0.02
        if ranges[beam] > distance + tolerance:
            if abs(across) <= NEAR:
                point["passed"] |= PASSED_RIGHT if across > 0.0 else PASSED_LEFT
                if abs(across) <= point["pose_std"]:
                    point["passed"] += THROUGH
            both_sides = point["passed"] % THROUGH == PASSED_LEFT | PASSED_RIGHT
            if both_sides or point["passed"] >= 2 * THROUGH:
                point["live"] = False
        elif abs(ranges[beam] - distance) <= tolerance:
            point["passed"], point["beam"] = 0, beam


@kernel
def blind_zone_radius(point, parameters):
    """Return the radius around the robot within which beams may not tell of a point: it is in their blind zone [m]."""
    return parameters.range_min + 3.0 * (point["std"] + point["pose_std"])


@kernel
def _is_seen_beside(point, place, beam, beams, parameters):
    """Tell whether a beam beside a silent one has an echo where a point may be, as badly as poses tell.

    `place` (2,) is the point's in the body frame [m], `beam` the one nearest to its direction.
    """
    (x, y), (ranges, directions) = place, beams
    aside = 3.0 * math.sqrt(2.0) * point["pose_std"]
    along = aside + 3.0 * math.sqrt(2.0) * point["std"]
    for step in (-1, 1):
        for away in range(1, MOST_BESIDE + 1):
            other = next_beam(beam, step * away, parameters)
            if other < 0 or abs(directions[other, 0] * y - directions[other, 1] * x) > aside:
                break
            if abs(ranges[other] - (directions[other, 0] * x + directions[other, 1] * y)) <= along:
                return True
    return False


@kernel
def _in_body_frame(points, pose, parameters):
    """Return where all points are, x and y [m] in the body frame, and how far ahead of the first beam, roughly [gaps].

    Apart from what is decided by it: a branch that the processor guesses wrong would wait for all of this.
    """
    xs, ys, ahead = np.empty(len(points)), np.empty(len(points)), np.empty(len(points))
    cos, sin, first, gap = math.cos(pose.heading), math.sin(pose.heading), parameters.first, parameters.gap
    for i in range(len(points)):
        x, y = points[i]["x"] - pose.x, points[i]["y"] - pose.y
        xs[i], ys[i] = cos * x + sin * y, cos * y - sin * x
    for i in range(len(points)):
        ahead[i] = roughly_ahead(xs[i], ys[i], first, gap)
    return xs, ys, ahead


@kernel
def free_slot(points, start):
    """Return a free place in the memory from `start` on; without one, that of the oldest point."""
    for i in range(start, len(points)):
        if not points[i]["live"]:
            return i
    oldest = 0
    for i in range(len(points)):
        if points[i]["time"] < points[oldest]["time"]:
            oldest = i
    return oldest
