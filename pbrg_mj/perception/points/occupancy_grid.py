"""What is known to be free on blind sides: an occupancy grid around each robot.

Cells are squares of the world, so that what is known stays where it is while the robot moves. A cell is known to be
free if the robot's body was there, a beam passed it, as `known_free` says, in the newest scan that told of its
direction, or, before the first scan, if it is within the disc that a robot needs to turn on the spot. *Assumed*: what
was free stays so while nobody looks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

CELLS = 8.0  # a clearance: so fine is what is known
ROOM = 1.0  # clearances that are known beyond the disc in which a robot turns: where it came from is free


class OccupancyGrid(NamedTuple):
    """The window of cells around a robot; cell (i, j) of the world has the indices i % C and j % C."""

    free: np.ndarray  # (C, C) bool; C is odd, or 0: there are no blind sides
    least: np.ndarray  # (2,) int64: the least i and the least j in the window


def empty_grids(robots: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `OccupancyGrid` of robots that know of nothing: (robots, count, count) bool and (robots, 2) int64."""
    return np.zeros((robots, count, count), dtype=bool), np.zeros((robots, 2), dtype=np.int64)


@kernel
def move_grid(grid, pose, parameters):
    """Bring the window of `OccupancyGrid` to a pose, with nothing known of new cells but what the robot's body is on.

    Of a robot that is at no cell that it knows, at its first scan or elsewhere all at once, it is the whole disc in
    which it turns.
    """
    free, least = grid
    count, half = len(free), len(free) // 2
    here = math.floor(pose.x / parameters.cell), math.floor(pose.y / parameters.cell)
    known = _is_free(grid, here[0], here[1])
    if least[0] != here[0] - half or least[1] != here[1] - half:
        for i in range(here[0] - half, here[0] + half + 1):
            for j in range(here[1] - half, here[1] + half + 1):
                if not _is_in_window(grid, i, j):
                    free[i % count, j % count] = False
        least[0], least[1] = here[0] - half, here[1] - half
    radius = parameters.body_radius if known else parameters.blind_radius + parameters.cell
    most = math.ceil(radius / parameters.cell)
    for i in range(here[0] - most, here[0] + most + 1):
        for j in range(here[1] - most, here[1] + most + 1):
            x, y = (i + 0.5) * parameters.cell - pose.x, (j + 0.5) * parameters.cell - pose.y
            if x * x + y * y <= radius * radius:
                free[i % count, j % count] = True


@kernel
def _is_in_window(grid, i, j):
    count = len(grid.free)
    return 0 <= i - grid.least[0] < count and 0 <= j - grid.least[1] < count


@kernel
def _is_free(grid, i, j):
    """Tell whether a cell (i, j) of the world is known to be free."""
    return _is_in_window(grid, i, j) and grid.free[i % len(grid.free), j % len(grid.free)]


@kernel
def free_range(grid, angle, pose, parameters):
    """Return how far all cells are known to be free in a direction [rad] in the world, from the robot's centre [m]."""
    step, along_x, along_y = 0.5 * parameters.cell, math.cos(angle), math.sin(angle)
    most = parameters.cell * (len(grid.free) // 2)
    reach = 0.0
    while reach + step <= most:
        x, y = pose.x + (reach + step) * along_x, pose.y + (reach + step) * along_y
        if not _is_free(grid, math.floor(x / parameters.cell), math.floor(y / parameters.cell)):
            break
        reach += step
    return reach


@kernel
def update_grid(grid, corners, widest, pose, parameters):
    """Mark the cells in directions of which a scan tells: free up to the chords between corners, else not known to be.

    `corners` are angles (N,) in the world [rad], ascending, and ways (N,) [m], how far it is free there. Between two
    that are farther apart than `widest` [rad] the scan tells nothing; what the robot's body is on stays free.
    """
    angles, ways = corners
    count, body = len(grid.free), parameters.body_radius
    xs, ys, parted = ways * np.cos(angles), ways * np.sin(angles), np.empty(len(angles), np.bool_)
    turns, cos, sin = angles - angles[0], math.cos(angles[0]), math.sin(angles[0])
    for a in range(len(angles)):
        after = turns[a + 1] if a + 1 < len(angles) else 2.0 * math.pi
        parted[a] = after - turns[a] > widest
    for i in range(grid.least[0], grid.least[0] + count):
        for j in range(grid.least[1], grid.least[1] + count):
            x, y = (i + 0.5) * parameters.cell - pose.x, (j + 0.5) * parameters.cell - pose.y
            if x * x + y * y <= body * body:
                continue
            turn = math.atan2(cos * y - sin * x, cos * x + sin * y)
            a = np.searchsorted(turns, turn if turn >= 0.0 else turn + 2.0 * math.pi, side="right") - 1
            if not parted[a]:
                b = a + 1 if a + 1 < len(angles) else 0
                left = (xs[b] - xs[a]) * (y - ys[a]) - (ys[b] - ys[a]) * (x - xs[a])
                grid.free[i % count, j % count] = left >= 0.0
