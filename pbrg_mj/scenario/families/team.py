"""Points in a disc that keep apart: starts and formations."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.errors import InputError

MOST_DRAWS = 100  # of one place, and of sets of places
DECIMALS = 4  # tenths of a millimetre
Point = tuple[float, float]


def points_apart(count: int, radius: float, spacing: float, random: np.random.Generator) -> np.ndarray:
    """Return points (count, 2) [m] uniform in the disc around the origin, each `spacing` or more from those before.

    Raises InputError when no room is found for them.
    """
    for _ in range(MOST_DRAWS):
        points: list[Point] = []
        while len(points) < count:
            fitting = _fitting(points, radius, spacing, random)
            if fitting is None:
                break
            points.append(fitting)
        else:
            return np.array(points)
    raise InputError(
        f"finds no places for {count} points {spacing:g} m apart in a disc of radius {radius:g} m; "
        "allowed: larger radii, a smaller spacing, fewer robots"
    )


def _fitting(points: list[Point], radius: float, spacing: float, random: np.random.Generator) -> Point | None:
    """Return one more point, or None after many that are too near to another."""
    for _ in range(MOST_DRAWS):
        reach, turn = radius * math.sqrt(random.random()), 2 * math.pi * random.random()
        point = round(reach * math.cos(turn), DECIMALS), round(reach * math.sin(turn), DECIMALS)
        if all(math.dist(one, point) >= spacing for one in points):
            return point
    return None
