"""Walls and boxes that stand still: footprints and their faces."""

from __future__ import annotations

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


def distance_to_obstacles(scenario: Scenario, points: np.ndarray) -> float:
    """Return the distance of the nearest of `points` (k, 2) [m] from the nearest face; inf without obstacles."""
    return float(signed_distance(points, footprints(scenario)).min(initial=np.inf))
