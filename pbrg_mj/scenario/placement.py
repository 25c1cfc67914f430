"""Where robots and walls stand at the start, and that none stands in another."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from pbrg_mj.scenario.base import Vector
from pbrg_mj.scenario.findings import Finding
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.surroundings import Wall
from pbrg_mj.scenario.words import show

# The size of the robot in models/robot.xml; a test holds the two together.
BODY_RADIUS = 0.06  # of the disc that the body fits in, around the body's centre [m]
HAND_OFFSET = 0.04  # of the hand point ahead of the body's centre [m]

SHORTEST_WALL = 1e-6  # [m]
ROUNDING = 1e-9  # [m] robots that just touch do not overlap


def placement(scenario: Scenario) -> Iterator[Finding]:
    """Yield walls without length, walls that stand in a robot, and robots that stand in each other.

    Robots of the ideal plant are points: they hold no place against each other, only against walls.
    """
    physics = scenario.plant == "physics"
    places = body_centres(scenario) if physics else scenario.team.start
    for k, wall in enumerate(scenario.world.walls):
        yield from _wall(k, wall, places, BODY_RADIUS if physics else 0.0)
    if physics:
        yield from _overlaps(places)


def body_centres(scenario: Scenario) -> tuple[Vector, ...]:
    """Return the centre of each robot's body at the start, in the world [m]."""
    heading = scenario.team.heading_deg
    degrees = heading if isinstance(heading, tuple) else (heading,) * scenario.robots
    return tuple(
        (x - HAND_OFFSET * math.cos(math.radians(turn)), y - HAND_OFFSET * math.sin(math.radians(turn)))
        for (x, y), turn in zip(scenario.team.start, degrees, strict=True)
    )


def distance_to_wall(wall: Wall, point: Vector) -> float:
    """Return the distance of a point from a wall's box, 0 inside it [m]."""
    length = math.dist(wall.start, wall.end)
    tx, ty = (wall.end[0] - wall.start[0]) / length, (wall.end[1] - wall.start[1]) / length
    x, y = point[0] - (wall.start[0] + wall.end[0]) / 2, point[1] - (wall.start[1] + wall.end[1]) / 2
    along, across = abs(x * tx + y * ty), abs(y * tx - x * ty)
    return math.hypot(max(along - length / 2, 0.0), max(across - wall.thickness / 2, 0.0))


def _wall(k: int, wall: Wall, places: tuple[Vector, ...], radius: float) -> Iterator[Finding]:
    path = ("world", "walls", k)
    length = math.dist(wall.start, wall.end)
    if length < SHORTEST_WALL:
        yield Finding(path, f"runs from {show(wall.start)} to {show(wall.end)}; allowed: two different points")
        return
    for robot, place in enumerate(places, start=1):
        distance = distance_to_wall(wall, place)
        if distance < radius or distance == 0:
            yield Finding(path, f"passes through robot {robot} at its start; allowed: {_room(radius, distance)}")


def _room(radius: float, distance: float) -> str:
    if not radius:
        return "hand points off the walls"
    return f"{radius} m or more between wall and body's centre, not {distance:.3g} m"


def _overlaps(places: tuple[Vector, ...]) -> Iterator[Finding]:
    for (i, a), (j, b) in combinations(enumerate(places), 2):
        distance = math.dist(a, b)
        if distance < 2 * BODY_RADIUS - ROUNDING:
            yield Finding(
                ("team", "start", j),
                f"puts robot {j + 1} onto robot {i + 1}, their bodies' centres {distance:.3g} m apart; "
                f"allowed: {2 * BODY_RADIUS} m or more",
            )
