"""What stands in a world: shapes in the frame of the way, and their footprints."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from other_worlds.geometry import rectangle, regular, star


class Solids:
    """Sections of a scenario's `world`, and the polygons of what they hold.

    Places are along and across the way to the reference, in units of `scale` [m], as lengths are.
    """

    def __init__(self, rng: np.random.Generator, scale: float, direction: float):
        self.rng, self.scale, self.direction = rng, scale, direction
        self.sections: dict[str, list[dict[str, Any]]] = {"walls": [], "boxes": [], "columns": [], "prisms": []}
        self.polygons: list[np.ndarray] = []
        c, s = np.cos(direction), np.sin(direction)
        self._axes = np.array([[c, s], [-s, c]])

    def at(self, along: float, across: float) -> np.ndarray:
        """Return a place in the world [m]."""
        return self.scale * np.array([along, across]) @ self._axes

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def wall(self, start: np.ndarray, end: np.ndarray, thickness: float | None = None) -> None:
        thickness = self.scale * (float(self.rng.choice([0.02, 0.05, 0.1])) if thickness is None else thickness)
        way = end - start
        length = float(np.linalg.norm(way))
        if length > 0.02:
            self.sections["walls"].append({"from": numbers(start), "to": numbers(end), "thickness": number(thickness)})
            size, angle = np.array([length, thickness]), float(np.arctan2(way[1], way[0]))
            self.polygons.append(rectangle((start + end) / 2, size, angle))

    def box(self, center: np.ndarray, size: np.ndarray, angle: float) -> None:
        """Add a box of that size in units of `scale`, at an angle to the way [rad]."""
        size, angle = self.scale * size, angle + self.direction
        degrees = number(np.degrees(angle))
        self.sections["boxes"].append({"center": numbers(center), "size": numbers(size), "angle_deg": degrees})
        self.polygons.append(rectangle(center, size, angle))

    def column(self, center: np.ndarray, radius: float) -> None:
        radius *= self.scale
        self.sections["columns"].append({"center": numbers(center), "radius": number(radius)})
        self.polygons.append(regular(center, radius))

    def prism(self, corners: np.ndarray) -> None:
        self.sections["prisms"].append({"corners": [numbers(corner) for corner in corners]})
        self.polygons.append(corners)


def room(solids: Solids) -> None:
    """Add a closed room of five to eleven walls around the team, convex or not."""
    count = int(solids.rng.integers(5, 12))
    angles = np.sort(solids.rng.uniform(0, 2 * np.pi, count))
    corners = star(np.zeros(2), solids.scale * solids.rng.uniform(1.1, 3.5, count), angles)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        solids.wall(start, end, 0.05)


def fence(solids: Solids) -> None:
    """Add a row of posts of 3 to 16 cm across the way, 10 to 60 cm apart, some of them missing."""
    along, apart, slant = solids.uniform(0.6, 1.8), solids.uniform(0.1, 0.6), solids.uniform(-0.6, 0.6)
    for across in np.arange(-1.5, 1.5, apart):
        center = solids.at(along + slant * across, across)
        kind = solids.rng.random()
        if kind < 0.4:
            solids.column(center, float(solids.rng.choice([0.015, 0.02, 0.03, 0.05])))
        elif kind < 0.85:
            solids.box(center, solids.rng.uniform(0.02, 0.08, 2), solids.uniform(0, np.pi / 2))


def zigzag(solids: Solids) -> None:
    """Add a folded wall across the way."""
    along, depth, step = solids.uniform(0.7, 2.0), solids.uniform(0.05, 0.4), solids.uniform(0.15, 0.6)
    corners = [solids.at(along + depth * (-1) ** k, -2 + k * step) for k in range(int(4 / step) + 1)]
    for start, end in pairwise(corners):
        solids.wall(start, end, 0.03)


def gear(solids: Solids) -> None:
    """Add a prism with three to eight teeth."""
    teeth, radius = int(solids.rng.integers(3, 9)), solids.uniform(0.25, 0.6)
    radii = solids.scale * radius * np.tile([1.0, solids.uniform(0.4, 0.9)], teeth)
    angles = solids.uniform(0, 2 * np.pi) + np.arange(2 * teeth) * np.pi / teeth
    solids.prism(star(solids.at(solids.uniform(0.8, 2.0), solids.uniform(-0.5, 0.5)), radii, angles))


def spikes(solids: Solids) -> None:
    """Add one to three wedges that end in a point."""
    for _ in range(int(solids.rng.integers(1, 4))):
        foot, turn = solids.at(solids.uniform(0.6, 2.2), solids.uniform(-0.8, 0.8)), solids.uniform(0, 2 * np.pi)
        ahead = np.array([np.cos(turn), np.sin(turn)]) * solids.scale
        aside = np.array([-ahead[1], ahead[0]]) * solids.uniform(0.03, 0.15)
        solids.prism(np.array([foot + solids.uniform(0.3, 1.0) * ahead, foot + aside, foot - aside]))


def funnel(solids: Solids) -> None:
    """Add two walls beside the way that come together to 0.1 to 1.4 m."""
    begin, end, offset = solids.uniform(-0.8, 0.3), solids.uniform(1.2, 2.4), solids.uniform(-0.3, 0.3)
    wide, narrow = solids.uniform(1.0, 1.6), solids.uniform(0.05, 0.7)
    solids.wall(solids.at(begin, wide), solids.at(end, narrow + offset))
    solids.wall(solids.at(begin, -wide), solids.at(end, -narrow + offset))


def dead_end(solids: Solids) -> None:
    """Add three walls that are open to the team."""
    end, half, depth = solids.uniform(1.0, 2.2), solids.uniform(0.5, 1.2), solids.uniform(0.4, 1.4)
    offset = solids.uniform(-0.4, 0.4)
    solids.wall(solids.at(end, offset - half), solids.at(end, offset + half))
    for side in (offset - half, offset + half):
        solids.wall(solids.at(end, side), solids.at(end - depth, side))


def gaps(solids: Solids) -> None:
    """Add a row of boxes across the way with gaps of 5 to 90 cm."""
    along, across = solids.uniform(0.7, 2.0), -1.6
    while across < 1.6:
        length, depth = solids.uniform(0.15, 0.8), solids.uniform(0.05, 0.5)
        center = solids.at(along + solids.uniform(-0.2, 0.2), across + length / 2)
        solids.box(center, np.array([depth, length]), solids.uniform(-0.26, 0.26))
        across += length + float(solids.rng.choice([0.05, 0.15, 0.25, 0.3, 0.4, 0.6, 0.9]))


def loose_walls(solids: Solids) -> None:
    """Add four to eleven walls anywhere, most of them along the axes."""
    for _ in range(int(solids.rng.integers(4, 12))):
        middle, turn = solids.scale * solids.rng.uniform(-2.8, 2.8, 2), solids.uniform(0, np.pi)
        if solids.rng.random() < 0.6:
            turn = float(solids.rng.choice([0.0, np.pi / 2]))
        half = solids.scale * solids.uniform(0.1, 0.9) * np.array([np.cos(turn), np.sin(turn)])
        solids.wall(middle - half, middle + half)


def triangles(solids: Solids) -> None:
    """Add two to eight triangles of any shape anywhere."""
    for _ in range(int(solids.rng.integers(2, 9))):
        center, angles = solids.scale * solids.rng.uniform(-2.6, 2.6, 2), np.sort(solids.rng.uniform(0, 2 * np.pi, 3))
        corners = star(center, solids.scale * solids.rng.uniform(0.06, 0.5, 3), angles)
        (ax, ay), (bx, by) = corners[1] - corners[0], corners[2] - corners[0]
        if abs(ax * by - ay * bx) > 0.002 * solids.scale**2:
            solids.prism(corners)


def beside(solids: Solids) -> None:
    """Add a wall along the way, up to 9 degrees askew, and often another one opposite."""
    slant, begin, length = solids.uniform(-0.15, 0.15), solids.uniform(-0.5, 1.2), solids.uniform(0.5, 3.0)
    side = float(solids.rng.choice([-1, 1])) * solids.uniform(0.15, 1.0)
    solids.wall(solids.at(begin, side), solids.at(begin + length, side + slant * length))
    if solids.rng.random() < 0.5:
        start = solids.at(begin + length * solids.uniform(0.3, 1.0), side - np.sign(side) * solids.uniform(0.5, 1.0))
        solids.wall(start, solids.at(begin + length + 1.0, side - np.sign(side) * solids.uniform(0.4, 1.0)))


def pillars(solids: Solids) -> None:
    """Add three to eleven columns of 2 to 63 cm radius anywhere."""
    for _ in range(int(solids.rng.integers(3, 12))):
        solids.column(solids.scale * solids.rng.uniform(-2.6, 2.6, 2), 10 ** solids.uniform(-1.7, -0.2))


SHAPES: dict[str, Callable[[Solids], None]] = {
    one.__name__: one
    for one in (
        room,
        fence,
        zigzag,
        gear,
        spikes,
        funnel,
        dead_end,
        gaps,
        loose_walls,
        triangles,
        beside,
        pillars,
    )
}


def number(value: float) -> float:
    """Return a value as a scenario has it: to 0.1 mm."""
    return round(float(value), 4)


def numbers(values: np.ndarray) -> list[float]:
    return [number(value) for value in values]
