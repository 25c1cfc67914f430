"""One face: which places it is made of, its normal, and where its half-space ends."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.hull import distance_to_hull
from pbrg_mj.perception.points.lines import extension_limits, is_on_line
from pbrg_mj.perception.points.obstacle_points import copy_point, inset_along, nearest_point, swap_points
from pbrg_mj.perception.points.parameters import LEAST_FREE

REACH = 1.0  # [m] of a hull, around the nearest place
WINDOWS = (REACH, 0.5, 0.25, 0.125)  # [m]
LEAST_HYSTERESIS, MOST_HYSTERESIS = 0.004, 0.01
"""[m] of distance that may be lost so that a normal does not turn with the noise of every scan: as much as the pose's
standard deviation at the nearest place, within these.

Before a round thing with r behind it the team rests where the normal points at r. That equilibrium is unstable, but a
normal that stays makes it stable, within sqrt(2 R d) to either side, R from the thing's centre and d the
hysteresis: 5 cm at 0.3 m and 4 mm."""
LOSS = 0.03  # [m] of it that a hull may take in any case: two places before a robot make no wedge around its target


@kernel
def next_face(places, count, window, path):
    """Write the places of the face nearest to the path to `window`.

    Returns how many there are, its normal, and which of them is the nearest.
    """
    nearest, best, gx, gy = nearest_point(places, count, path)
    if nearest < 0:
        return 0, (0.0, 0.0), (0.0, 0.0)
    enough, around = min(LEAST_FREE * best, best - LOSS), (places.x[nearest], places.y[nearest])
    wider, size = places, count
    for radius in WINDOWS:
        size, wider = _places_within(radius, around, wider, size, window), window
        gap, x, y = distance_to_hull(window.x, window.y, size, path)
        if gap >= enough and gap > 0.0:
            return size, (x / gap, y / gap), around
    copy_point(places, nearest, window, 0)
    return 1, (gx, gy), around


@kernel
def _places_within(radius, around, places, count, window):
    """Write the places within a radius around a point, around (2,) [m], to `window`; return how many there are.

    `window` may be `places` itself.
    """
    within, size = np.empty(count, np.int64), 0
    for i in range(count):  # without a branch, which would be guessed wrong
        x, y = places.x[i] - around[0], places.y[i] - around[1]
        within[size] = i
        size += x * x + y * y <= radius * radius
    for k in range(size):
        copy_point(places, within[k], window, k)
    return size


@kernel
def hysteresis(face, normal):
    """Return how much distance a normal of the scan before may cost at a face (window, size, path) [m]."""
    (window, size, _), (gx, gy) = face, normal
    ahead, std = math.inf, 0.0
    for i in range(size):
        along = gx * window.x[i] + gy * window.y[i]
        if along < ahead and window.point[i] >= 0:
            ahead, std = along, window.memory[window.point[i]]["pose_std"]
    return min(max(std, LEAST_HYSTERESIS), MOST_HYSTERESIS)


@kernel
def clearance_along(face, normal):
    """Return how far the places of a face (window, size, path) are ahead of the path along a unit vector [m]."""
    window, size, path = face
    gx, gy = normal
    ahead = math.inf
    for i in range(size):
        ahead = min(ahead, gx * window.x[i] + gy * window.y[i])
    return ahead - max(gx * path[0] + gy * path[1], gx * path[2] + gy * path[3])


@kernel
def offset(window, size, normal, parameters):
    """Return where the hand point is at the nearest of a face's places, and h of its half-space [m]."""
    gx, gy = normal
    nearest = math.inf
    for i in range(size):
        along = gx * window.x[i] + gy * window.y[i]
        if along - window.inset[i] < nearest:
            nearest = min(nearest, along - inset_along(window, i, normal, parameters)[0])
    count, widest = 0, 0.0
    for i in range(size):
        along = gx * window.x[i] + gy * window.y[i]
        if along - window.inset[i] <= nearest + window.std[i]:
            inset, std = inset_along(window, i, normal, parameters)
            if along - inset <= nearest + std:
                count, widest = count + 1, max(widest, std)
    return nearest, nearest - parameters.range_sigmas[min(count, len(parameters.range_sigmas)) - 1] * widest


@kernel
def points_not_separated(places, count, half_space_and_line, parameters):
    """Put the places that a half-space (normal, nearest, h) leaves before the others; return how many there are.

    `half_space_and_line` has the `Line` of its face, too: places on that are kept off.
    """
    half_space, line = half_space_and_line
    normal, nearest, h = half_space
    (gx, gy), near, left = normal, min(nearest, h), 0  # what is nearer by the clearance alone is left in any case
    may, candidates = np.empty(count, np.int64), 0
    for i in range(count):  # without a branch, which would be guessed wrong
        along = gx * places.x[i] + gy * places.y[i]
        may[candidates] = i
        candidates += along - places.inset[i] < min(nearest, h + parameters.sigmas * places.std[i])
    limits = extension_limits(places, may[:candidates], line)
    for i in may[:candidates]:
        along = gx * places.x[i] + gy * places.y[i]
        if is_on_line(places, i, line, limits):
            continue
        if along - parameters.clearance < near or _is_left(places, i, along, half_space, parameters):
            swap_points(places, i, left)
            left += 1
    return left


@kernel
def _is_left(places, i, along, half_space, parameters):
    """Tell whether a half-space (normal, nearest, h) does not keep off a place that is so far along its normal."""
    normal, nearest, h = half_space
    inset, std = inset_along(places, i, normal, parameters)
    return along - inset < min(nearest, h + parameters.sigmas * std)
