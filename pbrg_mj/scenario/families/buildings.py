"""A place in a building: its walls about the team, the x axis of the way's frame from there to a later place."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.families.distributions import random_of
from pbrg_mj.scenario.families.frame import PathFrame
from pbrg_mj.scenario.families.placement import MOST_DRAWS, distances
from pbrg_mj.scenario.families.schema import BuildingDraw, Draw
from pbrg_mj.scenario.families.shapes import Entries
from pbrg_mj.scenario.schema.base import MOST_OBSTACLES, Vector

Obstacles = dict[str, Entries]  # by the key of `world` that they go to


def drawn_building(draw: Draw, seed: int) -> int:
    """Return the index of the seed's building."""
    return int(random_of(seed, "building").random() * len(draw.buildings))


def building_around(
    draw: Draw, index: int, seed: int, frame: PathFrame, distance: float, start: np.ndarray
) -> Obstacles:
    """Return what stands about a place on the building's way: the origin, with the reference `distance` [m] ahead.

    `start` are hand points (n, 2) [m], from which all keeps its clearance. Raises InputError when no place is found,
    or more stands there than a world may hold.
    """
    if distance <= 0:
        raise InputError(f"has the reference {distance:g} m ahead; allowed: more than 0")
    building, random = draw.buildings[index], random_of(seed, "buildings", index)
    length = sum(math.dist(*ends) for ends in pairwise(building.way))
    for _ in range(MOST_DRAWS):
        place, later = way_from(building.way, length * random.random())
        ahead = place_ahead(place, later, distance)
        if ahead is None:
            continue
        found = _seen(building, place, ahead, frame)
        if all((distances(kind, entries, start) >= draw.start_clearance).all() for kind, entries in found.items()):
            return found
    raise InputError(
        f"finds no place in {MOST_DRAWS} draws that keeps {draw.start_clearance:g} m from the robots' start "
        f"with {distance:g} m ahead on a way of {length:.4g} m"
    )


def way_from(way: tuple[Vector, ...], along: float) -> tuple[Vector, tuple[Vector, ...]]:
    """Return the place `along` a way [m], and the corners after it."""
    for k, (start, end) in enumerate(pairwise(way)):
        side = math.dist(start, end)
        if along < side:
            return _between(start, end, along / side), way[k + 1 :]
        along -= side
    return way[-1], ()


def place_ahead(place: Vector, later: tuple[Vector, ...], distance: float) -> Vector | None:
    """Return where a way from `place` over the corners `later` is first so far off [m]; None where it never is."""
    for start, end in pairwise((place, *later)):
        if math.dist(place, end) < distance:
            continue
        (dx, dy), (x, y) = (end[0] - start[0], end[1] - start[1]), (start[0] - place[0], start[1] - place[1])
        a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - distance * distance
        return _between(start, end, (-b + math.sqrt(max(b * b - a * c, 0.0))) / a) if a > 0 else end
    return None


def _between(start: Vector, end: Vector, share: float) -> Vector:
    return start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])


def _seen(building: BuildingDraw, place: Vector, ahead: Vector, frame: PathFrame) -> Obstacles:
    """Return walls and posts that are near enough to the place, in the world."""
    far = math.dist(place, ahead)
    c, s = ((ahead[k] - place[k]) / far if far > 0 else 1.0 - k for k in (0, 1))

    def to_world(corner: Vector) -> list[float]:
        x, y = corner[0] - place[0], corner[1] - place[1]
        return frame.to_world(c * x + s * y, c * y - s * x)

    sides = [ends for corners in building.walls for ends in pairwise(corners)]
    walls: list[dict[str, Any]] = [
        {"from": to_world(start), "to": to_world(end), "thickness": building.thickness}
        for start, end in sides
        if _distance(place, start, end) <= building.within
    ]
    posts: list[dict[str, Any]] = [
        {"center": to_world(post), "radius": building.thickness / 2}
        for post in building.posts
        if math.dist(place, post) <= building.within
    ]
    found = {"walls": walls, "columns": posts}
    for kind, entries in found.items():
        if len(entries) > MOST_OBSTACLES:
            raise InputError(
                f"has {len(entries)} {kind} within {building.within:g} m of a place on its way; "
                f"allowed: at most {MOST_OBSTACLES}, by a shorter `within`"
            )
    return {kind: entries for kind, entries in found.items() if entries}


def _distance(point: Vector, start: Vector, end: Vector) -> float:
    """Return the distance of a point from a segment [m]."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    share = (point[0] - start[0]) * dx + (point[1] - start[1]) * dy
    return math.dist(point, _between(start, end, min(max(share / max(dx * dx + dy * dy, 1e-300), 0.0), 1.0)))
