"""Walls and boxes that stand still: footprints and their faces."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import Rectangles, signed_distance, wall_rectangles


def footprints(scenario: Scenario) -> Rectangles:
    """Return the footprints of the walls, then of the boxes; boxes that move are left out."""
    return wall_rectangles(scenario.world.obstacles)


def names(scenario: Scenario) -> list[str]:
    """Return the obstacles' names as the scenario has them, counted from 0, in the order of `footprints`."""
    world = scenario.world
    return [f"walls.{k}" for k in range(len(world.walls))] + [f"boxes.{k}" for k in range(len(world.boxes))]


def faces(rectangles: Rectangles, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the four faces of one footprint as G (4, 2), h (4,) [m]: outside of face f is G[f] @ q <= h[f]."""
    along = rectangles.axis[index]
    across = np.array([-along[1], along[0]])
    # A face's outward normal points at a robot in front of it: the half-space's own normal is its opposite.
    G = -np.array([along, -along, across, -across])
    depth = rectangles.half_size[index][[0, 0, 1, 1]]
    return G, G @ rectangles.centre[index] - depth


def moving_footprints(scenario: Scenario) -> Rectangles:
    """Return the footprints of moving boxes at all their waypoints."""
    return wall_rectangles([box.at(at).as_wall() for box in scenario.world.moving_boxes for at in box.waypoints])


def footprint_corners(rectangles: Rectangles) -> np.ndarray:
    """Return the corners (w, 4, 2) [m] of footprints, in turn."""
    along = rectangles.axis * rectangles.half_size[:, :1]
    across = np.column_stack([-rectangles.axis[:, 1], rectangles.axis[:, 0]]) * rectangles.half_size[:, 1:]
    c = rectangles.centre
    return np.stack([c - along - across, c + along - across, c + along + across, c - along + across], axis=1)


def area_of_interest(scenario: Scenario, team: np.ndarray, beside: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner (2,) [m] of what a picture of a run should show.

    That is all points `team` (k, 2), and whatever stands or moves near them: an obstacle that reaches within `beside`
    [m] of the team's bounding box widens it as far as that. What is farther must not make the team small.
    """
    low, high = team.min(axis=0), team.max(axis=0)
    shown_low, shown_high = low, high
    for corners in [*footprint_corners(footprints(scenario)), *_swept(scenario)]:
        first, last = np.maximum(corners.min(axis=0), low - beside), np.minimum(corners.max(axis=0), high + beside)
        if (first <= last).all():
            shown_low, shown_high = np.minimum(shown_low, first), np.maximum(shown_high, last)
    return shown_low, shown_high


def _swept(scenario: Scenario) -> Iterator[np.ndarray]:
    """Yield the corners (8, 2) [m] of every moving box at a waypoint and the next; at its only one, twice."""
    for box in scenario.world.moving_boxes:
        corners = footprint_corners(wall_rectangles([box.at(at).as_wall() for at in box.waypoints]))
        for first, last in pairwise([*corners, corners[-1]]):
            yield np.vstack([first, last])


def distance_to_obstacles(scenario: Scenario, points: np.ndarray) -> float:
    """Return the distance of the nearest of `points` (k, 2) [m] from the nearest face; inf without obstacles."""
    return float(signed_distance(points, footprints(scenario)).min(initial=np.inf))
