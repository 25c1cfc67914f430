"""Points that hand points must keep away from, and the path of a hand point as far as it is free of them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.segment import vector_from_segment

BLOCK = 16  # places that are looked through at a time for any that is nearer: several an instruction


class ObstaclePoints(NamedTuple):
    """Echoes that bind and the edge of what is known to be free; functions look at the first `count` of each array."""

    x: np.ndarray  # (M,) [m]
    y: np.ndarray  # (M,) [m]
    std: np.ndarray  # (M,) of the range [m]
    inset: np.ndarray  # (M,) how far the hand point must stay from a place known as badly as the robot's pose [m]
    squared: np.ndarray  # (M,) of the distance from the path [m^2], once `measure_from` has written it
    point: np.ndarray  # (M,) the number of its point in the memory, -1 for the edge
    memory: np.ndarray  # of POINT


@kernel
def empty_points(size, memory):
    """Return room for `size` places, of points of a memory."""
    x, y, point = np.empty(size), np.empty(size), np.empty(size, np.int64)
    return ObstaclePoints(x, y, np.empty(size), np.empty(size), np.empty(size), point, memory)


@kernel
def obstacle_points(points, edge, parameters):
    """Return the `ObstaclePoints` of the points that bind and of the `Edge`, and how many there are."""
    places, count = empty_points(len(points) + len(edge.x), points), 0
    for i in range(len(points)):
        point = points[i]  # each is written over the last that does not count: branches would be guessed wrong
        places.x[count], places.y[count], places.std[count] = point["x"], point["y"], point["std"]
        places.inset[count] = parameters.clearance + parameters.sigmas * point["pose_std"] + point["protrusion"]
        places.point[count] = i
        count += point["live"] & point["binds"]
    for i in range(len(edge.x)):
        places.x[count], places.y[count], places.std[count] = edge.x[i], edge.y[i], 0.0
        places.inset[count] = parameters.clearance + parameters.sigmas * edge.pose_std[i]
        places.point[count] = -1
        count += 1
    return _first(places, count), count


@kernel
def _first(places, count):
    """Return arrays of the first places alone: none is left unwritten."""
    x, y, std, inset = places.x[:count], places.y[:count], places.std[:count], places.inset[:count]
    return ObstaclePoints(x, y, std, inset, places.squared[:count], places.point[:count], places.memory)


@kernel
def inset_along(places, i, normal, parameters):
    """Return how far the hand point must stay from place i along a unit vector, and its range's deviation there [m].

    Neither is more than `inset` and `std`: a range is wrong along its beam alone, a heading across it, and a corner on
    a face that is known sticks out along that face.
    """
    if places.point[i] < 0:
        return places.inset[i], places.std[i]
    (gx, gy), point = normal, places.memory[places.point[i]]
    ahead, aside = gx * point["ux"] + gy * point["uy"], gx * point["uy"] - gy * point["ux"]
    turn = point["turn_std"] ** 2
    pose = math.sqrt(max(point["pose_std"] ** 2 - turn, 0.0) + turn * aside * aside)
    corner = min(point["protrusion"], abs(gx * point["along_x"] + gy * point["along_y"]) + point["slack"])
    inset = parameters.clearance + parameters.sigmas * pose + corner
    return min(inset, places.inset[i]), places.std[i] * min(abs(ahead), 1.0)


@kernel
def copy_point(source, i, target, k):
    """Write point i of one array to place k of another."""
    target.x[k], target.y[k] = source.x[i], source.y[i]
    target.std[k], target.inset[k], target.point[k] = source.std[i], source.inset[i], source.point[i]


@kernel
def swap_points(places, i, k):
    """Exchange two points."""
    places.x[i], places.x[k] = places.x[k], places.x[i]
    places.y[i], places.y[k] = places.y[k], places.y[i]
    places.std[i], places.std[k] = places.std[k], places.std[i]
    places.inset[i], places.inset[k] = places.inset[k], places.inset[i]
    places.point[i], places.point[k] = places.point[k], places.point[i]
    places.squared[i], places.squared[k] = places.squared[k], places.squared[i]


@kernel
def free_path(places, count, q, target, parameters):
    """Return both ends of the path from the hand point q (2,) [m].

    It ends where it first comes as near to a place as is allowed, or at the target (2,) [m].
    """
    dx, dy = target[0] - q[0], target[1] - q[1]
    length = math.sqrt(dx * dx + dy * dy)
    if not length > 0.0:
        return q[0], q[1], q[0], q[1]
    dx, dy, free = dx / length, dy / length, length
    for i in range(count):
        x, y = places.x[i] - q[0], places.y[i] - q[1]
        inset = places.inset[i] + parameters.sigmas * places.std[i]
        along, squared = x * dx + y * dy, x * x + y * y
        across = squared - along * along
        if across <= inset * inset and along > 0.0:  # most places are not beside the line, half of them ahead
            if squared <= inset * inset:  # already nearer: any approach ends at once
                free = 0.0
            elif across < inset * inset:
                free = min(free, along - math.sqrt(inset * inset - across))
    return q[0], q[1], q[0] + free * dx, q[1] + free * dy


@kernel
def measure_from(path, places, count):
    """Write the squared distance of each place from the path."""
    for i in range(count):
        x, y = vector_from_segment(path, places.x[i], places.y[i])
        places.squared[i] = x * x + y * y


@kernel
def nearest_point(places, count, path):
    """Return the place nearest to the path, -1 for none; its distance [m] and the direction to it."""
    nearest, best = -1, math.inf
    for start in range(0, count, BLOCK):
        stop, nearer = min(start + BLOCK, count), 0
        for i in range(start, stop):
            nearer += (places.squared[i] > 0.0) & (places.squared[i] < best)
        if nearer > 0:
            for i in range(start, stop):
                if 0.0 < places.squared[i] < best:
                    nearest, best = i, places.squared[i]
    if nearest < 0:
        return -1, 0.0, 0.0, 0.0
    x, y = vector_from_segment(path, places.x[nearest], places.y[nearest])
    distance = math.sqrt(best)
    return nearest, distance, x / distance, y / distance
