"""What a region of half-spaces is worth: its area, how far it lets a hand point go, and what it lets in too near."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from regions.polygon import area, cut, distance, inside_disc

from pbrg_mj.world.scene.footprints import Footprints, signed_distance

GRID = 0.025  # [m] between places that are held against the solids
TOLERANCE = 1e-6  # [m]
NOTED = 0.01  # [m] by which a place must be too near to be counted


class Region(NamedTuple):
    """Where G q <= h."""

    G: np.ndarray  # (k, 2) outward unit normals
    h: np.ndarray  # (k,) [m]


class Worth(NamedTuple):
    """Figures of one region."""

    area: float  # within the sensor's range [m^2]
    ahead: float  # how far straight towards the target [m]
    left: float  # from its place nearest to the target to the target [m]
    faces: int  # half-spaces that bound it within the range
    holds: bool  # the hand point is in it
    too_near: float  # share of the area nearer than the clearance to a solid
    depth: float  # by how much at most [m]; 0 where nothing is
    away: float  # from the hand point to the nearest place that is too near by more than `NOTED` [m]; inf for none


def worth(region: Region, view: tuple[np.ndarray, np.ndarray, float], solids: Footprints, clearance: float) -> Worth:
    """Return the figures of a region for a hand point and a target (2,) [m], and a sensor's range [m]."""
    hand, target, reach = view
    corners = cut(inside_disc(hand, reach), *region)
    places = grid(corners)
    near = shortfalls(places, solids, clearance)
    noted = np.linalg.norm(places[near > NOTED] - hand, axis=1)
    return Worth(
        area=area(corners),
        ahead=ahead(region, hand, target),
        left=distance(target, corners),
        faces=len(bounding(region, corners)),
        holds=bool(np.all(region.G @ hand <= region.h + TOLERANCE)),
        too_near=float(np.mean(near > TOLERANCE)) if len(near) else 0.0,
        depth=float(near.max(initial=0.0)),
        away=float(noted.min(initial=np.inf)),
    )


def ahead(region: Region, hand: np.ndarray, target: np.ndarray) -> float:
    """Return how far [m] on the straight way from the hand point to the target the region holds; 0 if nothing of it."""
    far = float(np.linalg.norm(target - hand))
    direction = (target - hand) / far
    speed, room = region.G @ direction, region.h - region.G @ hand
    if np.any(room < -TOLERANCE):
        return 0.0
    return float(np.min(np.maximum(room[speed > 0.0], 0.0) / speed[speed > 0.0], initial=far))


def bounding(region: Region, corners: np.ndarray) -> np.ndarray:
    """Return which half-spaces have two corners of the polygon on their edge."""
    if not len(corners):
        return np.zeros(0, dtype=int)
    on_edge = np.abs(corners @ region.G.T - region.h) < TOLERANCE
    return np.flatnonzero(on_edge.sum(axis=0) >= 2)


def shortfalls(places: np.ndarray, solids: Footprints, clearance: float) -> np.ndarray:
    """Return by how much (k,) [m] places (k, 2) are nearer to a solid than the clearance; 0 if not."""
    if not len(places) or not len(solids.centre) + len(solids.first) - 1:
        return np.zeros(len(places))
    return np.maximum(clearance - signed_distance(places, solids).min(axis=1), 0.0)


def grid(corners: np.ndarray) -> np.ndarray:
    """Return the places (k, 2) of a square grid that lie in a convex polygon, counter-clockwise, and its corners."""
    if len(corners) < 3:
        return np.zeros((0, 2))
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], GRID), np.arange(low[1], high[1], GRID))
    places, side = np.column_stack([x.ravel(), y.ravel()]), np.roll(corners, -1, axis=0) - corners
    offset = places[:, None] - corners
    left = side[:, 0] * offset[..., 1] - side[:, 1] * offset[..., 0]
    return np.concatenate([places[np.all(left >= 0.0, axis=1)], corners])
