"""What stands still: footprints, their faces and outlines."""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.schema import MovingBox, Scenario
from pbrg_mj.world.scene.footprints import Footprints, edges, footprints_of, signed_distance, world_footprints
from pbrg_mj.world.scene.obstacles import box_centre

ROUND = 2 * np.pi * np.arange(48) / 48  # directions of the corners that a drawn column has


def footprints(scenario: Scenario) -> Footprints:
    """Return the footprints of walls, boxes, columns and prisms, in this order; boxes that move are left out."""
    return world_footprints(scenario.world)


def names(scenario: Scenario) -> list[str]:
    """Return the obstacles' names as the scenario has them, counted from 0, in the order of `footprints`.

    A prism with notches is named once for each of its parts.
    """
    world = scenario.world
    kinds = {"walls": world.walls, "boxes": world.boxes, "columns": world.columns}
    convex = [f"{kind}.{k}" for kind, things in kinds.items() for k in range(len(things))]
    return [*convex, *(f"prisms.{k}" for k, prism in enumerate(world.prisms) for _ in prism.convex())]


def faces(around: Footprints, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the f faces of one footprint as G (f, 2), h (f,) [m]: outside of a face is G[f] @ q <= h[f].

    A column has none: its tangents are without number.
    """
    if index >= len(around.centre):
        outward, offset = edges(around.polygon(index - len(around.centre)))
        return -outward, -offset
    if around.radius[index]:
        return np.zeros((0, 2)), np.zeros(0)
    along = around.axis[index]
    across = np.array([-along[1], along[0]])
    # A face's outward normal points at a robot in front of it: the half-space's own normal is its opposite.
    G = -np.array([along, -along, across, -across])
    depth = around.half_size[index][[0, 0, 1, 1]]
    return G, G @ around.centre[index] - depth


def moving_footprints(scenario: Scenario) -> Footprints:
    """Return the footprints of moving boxes at all their waypoints."""
    return footprints_of([box.at(at).as_wall() for box in scenario.world.moving_boxes for at in box.waypoints])


def closest_approach(box: MovingBox, time: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the middle (2,) [m] of a moving box when one of points (t, k, 2) [m] at times (t,) [s] is nearest to it.

    Points that are not finite are near nothing; the first of equal times counts.
    """
    way = box_centre(box, time)
    beyond = np.abs(points - way[:, None]) - np.array(box.size) / 2
    away = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.minimum(beyond.max(axis=-1), 0.0)
    return way[np.where(np.isfinite(away), away, np.inf).min(axis=1).argmin()]


def outlines(around: Footprints) -> list[np.ndarray]:
    """Return the corners (c, 2) [m] of each footprint in turn, for pictures: a column has 48."""
    along = around.axis * around.half_size[:, :1]
    across = np.column_stack([-around.axis[:, 1], around.axis[:, 0]]) * around.half_size[:, 1:]
    c, circle = around.centre, np.column_stack([np.cos(ROUND), np.sin(ROUND)])
    corners = np.stack([c - along - across, c + along - across, c + along + across, c - along + across], axis=1)
    rounded = [
        around.centre[k] + radius * circle if radius else corners[k] for k, radius in enumerate(around.radius.tolist())
    ]
    return [*rounded, *(around.polygon(k) for k in range(len(around.first) - 1))]


def distance_to_obstacles(scenario: Scenario, points: np.ndarray) -> float:
    """Return the distance of the nearest of `points` (k, 2) [m] from the nearest face; inf without obstacles."""
    return float(signed_distance(points, footprints(scenario)).min(initial=np.inf))
