"""What stands on the floor has an extent, and at the start no robot or obstacle stands in another."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from pbrg_mj.scenario.checks.distances import distances_to_column, distances_to_prism, distances_to_wall
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, yaml_text
from pbrg_mj.scenario.polygons import FLATTEST, SHORTEST, Polygon, flatness, is_simple
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import MovingBox, Ramp, Scenario, Vector, Wall

KINDS = {
    "walls": ("wall", "walls"),
    "boxes": ("box", "boxes"),
    "moving_boxes": ("box", "boxes"),
    "columns": ("column", "columns"),
    "prisms": ("prism", "prisms"),
    "thresholds": ("threshold", "thresholds"),
    "ramps": ("ramp", "ramps"),
}  # in the singular and for many
TOO_FLAT = "is flat or thin; allowed: a least extent of at least a millionth of the greatest"
ROUNDING = 1e-9  # [m] robots that just touch do not overlap


@dataclass(frozen=True)
class Obstacle:
    """Something that stands on the floor at the start."""

    path: KeyPath  # of its key
    distances: Callable[[np.ndarray], np.ndarray]  # of points (k, 2) from it, 0 inside (k,) [m]
    meets: str  # what it does to a robot in its way


def extents(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what has no length or no area, prisms whose sides cross, waypoints out of order."""
    world = scenario.world
    for name, lines in (("walls", world.walls), ("thresholds", world.thresholds), ("ramps", world.ramps)):
        for k, line in enumerate(lines):
            if math.dist(line.start, line.end) < SHORTEST:
                message = f"runs from {yaml_text(line.start)} to {yaml_text(line.end)}; allowed: two different points"
                yield Diagnostic(("world", name, k), message)
    for name, boxes in (("boxes", world.boxes), ("moving_boxes", world.moving_boxes)):
        for k, box in enumerate(boxes):
            if min(box.size) < SHORTEST:
                path = ("world", name, k, "size")
                yield Diagnostic(path, f"is {yaml_text(box.size)}; allowed: at least {SHORTEST} m either way")
    for k, prism in enumerate(world.prisms):
        if not is_simple(prism.corners):
            path = ("world", "prisms", k, "corners")
            yield Diagnostic(
                path,
                f"is {yaml_text(prism.corners)}; allowed: corners of a polygon, in turn, whose sides meet there alone",
            )
        elif any(flatness(part.corners, part.height) < FLATTEST for part in prism.convex()):
            yield Diagnostic(("world", "prisms", k), TOO_FLAT)
    for k, ramp in enumerate(world.ramps):
        if flatness(_footprint(ramp), ramp.height) < FLATTEST:
            yield Diagnostic(("world", "ramps", k), TOO_FLAT)
    for k, box in enumerate(world.moving_boxes):
        yield from _waypoints(("world", "moving_boxes", k, "waypoints"), box)
    for k, patch in enumerate(world.patches):
        if min(abs(a - b) for a, b in zip(patch.start, patch.end, strict=True)) < SHORTEST:
            span = f"{yaml_text(patch.start)} to {yaml_text(patch.end)}"
            yield Diagnostic(
                ("world", "patches", k), f"reaches from {span}; allowed: corners apart along x and along y"
            )


def _footprint(ramp: Ramp) -> Polygon:
    """Return a rectangle of a ramp's length and width."""
    length, across = math.dist(ramp.start, ramp.end), ramp.width
    return ((0.0, 0.0), (length, 0.0), (length, across), (0.0, across))


def placement(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield obstacles that stand in a robot, robots that overlap, and kidnapped robots put down onto any of them.

    Robots of the ideal plant are points: they hold no place against each other, only against obstacles.
    """
    physics = scenario.plant == "physics"
    places = body_centres(scenario) if physics else scenario.team.start
    still, radius = _still(scenario), robot_size(scenario.robot).body_radius
    for obstacle in (*still, *(_first_waypoints(scenario) if physics else ())):
        yield from _in_robots(obstacle, places, radius if physics else 0.0)
    if physics:
        yield from _overlaps(places, radius)
        yield from _put_down(scenario, still, places)


def body_centres(scenario: Scenario) -> tuple[Vector, ...]:
    """Return the centre of each robot's body at the start, in the world [m]."""
    heading = scenario.team.heading_deg
    degrees = heading if isinstance(heading, tuple) else (heading,) * scenario.robots
    offset = robot_size(scenario.robot).hand_offset
    return tuple(body_centre(hand, turn, offset) for hand, turn in zip(scenario.team.start, degrees, strict=True))


def body_centre(hand: Vector, heading_deg: float, offset: float) -> Vector:
    """Return the centre of the body whose hand point is there, `offset` ahead of it, in the world [m]."""
    turn = math.radians(heading_deg)
    return hand[0] - offset * math.cos(turn), hand[1] - offset * math.sin(turn)


def _still(scenario: Scenario) -> tuple[Obstacle, ...]:
    """Return what stands still."""
    world = scenario.world
    walls = (Obstacle(("world", "walls", k), _from_wall(one), "passes through") for k, one in enumerate(world.walls))
    solids = {
        "boxes": [_from_wall(box.as_wall()) for box in world.boxes],
        "columns": [partial(distances_to_column, column) for column in world.columns],
        "prisms": [partial(distances_to_prism, prism) for prism in world.prisms],
        "thresholds": [_from_wall(threshold.as_wall()) for threshold in world.thresholds],
        "ramps": [_from_wall(ramp.as_wall()) for ramp in world.ramps],
    }
    others = (
        Obstacle(("world", name, k), one, "stands in") for name, all_ in solids.items() for k, one in enumerate(all_)
    )
    return (*walls, *others)


def _from_wall(wall: Wall) -> Callable[[np.ndarray], np.ndarray]:
    return partial(distances_to_wall, wall)


def _first_waypoints(scenario: Scenario) -> Iterator[Obstacle]:
    """Yield the moving boxes where they rest at the start."""
    for k, box in enumerate(scenario.world.moving_boxes):
        yield Obstacle(("world", "moving_boxes", k), _from_wall(box.at(box.waypoints[0]).as_wall()), "stands in")


def _in_robots(obstacle: Obstacle, places: Sequence[Vector], radius: float) -> Iterator[Diagnostic]:
    distances = obstacle.distances(np.array(places))
    for robot in np.flatnonzero((distances < radius) | (distances == 0)).tolist():
        allowed = _allowed_distance(obstacle, radius, float(distances[robot]))
        message = f"{obstacle.meets} robot {robot + 1} at its start; allowed: {allowed}"
        yield Diagnostic(obstacle.path, message)


def _allowed_distance(obstacle: Obstacle, radius: float, distance: float) -> str:
    if not radius:
        return f"hand points off the {_kind(obstacle, plural=True)}"
    return f"{radius:g} m or more between {_kind(obstacle)} and body's centre, not {distance:.3g} m"


def _kind(obstacle: Obstacle, plural: bool = False) -> str:
    return KINDS[str(obstacle.path[1])][plural]


def _overlaps(places: Sequence[Vector], radius: float) -> Iterator[Diagnostic]:
    """Yield robots that stand in one before; each is compared with those in its own cell of a grid and in those around.

    A cell is as wide as a body, so that it holds four at most of those that do not overlap.
    """
    cells: dict[tuple[int, int], list[int]] = {}
    for j, b in enumerate(places):
        column, row = (math.floor(x / (2 * radius)) for x in b)
        near = (cells.get((column + x, row + y), ()) for x in (-1, 0, 1) for y in (-1, 0, 1))
        for i in sorted(k for cell in near for k in cell):
            distance = math.dist(places[i], b)
            if distance >= 2 * radius - ROUNDING:
                continue
            yield Diagnostic(
                ("team", "start", j),
                f"puts robot {j + 1} onto robot {i + 1}, their bodies' centres {distance:.3g} m apart; "
                f"allowed: {2 * radius:g} m or more",
            )
            break
        cells.setdefault((column, row), []).append(j)


def _put_down(scenario: Scenario, still: Sequence[Obstacle], places: Sequence[Vector]) -> Iterator[Diagnostic]:
    kidnappings, starts = scenario.disturbances.kidnappings, np.array(places)
    size = robot_size(scenario.robot)
    radius, offset = size.body_radius, size.hand_offset
    centres = np.array([body_centre(one.to, one.heading_deg, offset) for one in kidnappings]).reshape(-1, 2)
    for obstacle in still:
        distances = obstacle.distances(centres)
        for k in np.flatnonzero(distances < radius).tolist():
            yield _robot_onto(
                scenario,
                k,
                f"{_kind(obstacle)} {obstacle.path[2]}",
                _allowed_distance(obstacle, radius, float(distances[k])),
            )
    for k, kidnapping in enumerate(kidnappings):
        distances = np.hypot(*(starts - centres[k]).T)
        for other in np.flatnonzero(distances < 2 * radius - ROUNDING).tolist():
            if other + 1 != kidnapping.robot:
                yield _robot_onto(
                    scenario,
                    k,
                    f"robot {other + 1}'s start, their bodies' centres {distances[other]:.3g} m apart",
                    f"{2 * radius:g} m or more",
                )


def _robot_onto(scenario: Scenario, k: int, what: str, allowed: str) -> Diagnostic:
    robot = scenario.disturbances.kidnappings[k].robot
    return Diagnostic(("disturbances", "kidnappings", k, "to"), f"puts robot {robot} onto {what}; allowed: {allowed}")


def _waypoints(path: KeyPath, box: MovingBox) -> Iterator[Diagnostic]:
    for k, (before, after) in enumerate(pairwise(box.waypoints), start=1):
        if after.time <= before.time:
            message = f"is {after.time} s; allowed: later than the one before, {before.time} s"
            yield Diagnostic((*path, k, "time"), message)
