"""IRIS as Drake has it (Deits and Tedrake, WAFR 2014): convex obstacles, and a region that inflates between them.

Regions come in two kinds. About the hand point, IRIS starts there and stops before a step that would leave it out.
Along the way, it starts with the widest of some ellipses around the way and stops before a step that would leave a part
of that out.
"""

from __future__ import annotations

import numpy as np
from pydrake.geometry.optimization import HPolyhedron, Hyperellipsoid, Iris, IrisOptions
from regions.measures import Region
from regions.places import Places
from regions.polygon import around, around_discs, directions

from pbrg_mj.analysis.metrics.obstacles import outlines
from pbrg_mj.world.scene.footprints import Footprints

NARROWEST = 12  # times that the width of the ellipse around a way is halved
SHORT = 0.01  # [m] by which a way ends before the obstacle that it leads to
HELD = 1e-6  # [m]
Obstacles = list[HPolyhedron]


def of_solids(solids: Footprints, clearance: float, within: tuple[np.ndarray, float]) -> Obstacles:
    """Return the solids' convex parts, inflated by the clearance, that are within a range [m] of a place."""
    centre, reach = within
    corners = [one for one in outlines(solids) if _from_box(one, centre) < reach + clearance]
    return [HPolyhedron(*around_discs(one, np.full(len(one), clearance))) for one in corners]


def _from_box(corners: np.ndarray, place: np.ndarray) -> float:
    """Return the distance of a place from the bounding box of corners [m]."""
    beyond = np.maximum(corners.min(axis=0) - place, place - corners.max(axis=0))
    return float(np.linalg.norm(np.maximum(beyond, 0.0)))


def of_clusters(places: Places, clusters: list[np.ndarray], path: np.ndarray) -> Obstacles:
    """Return the hulls of clusters, inflated by the places' insets; where one meets the path, each place by itself."""
    reach, found = places.insets(directions()), []
    for cluster in clusters:
        hull = HPolyhedron(*around(places.at[cluster], reach[cluster]))
        parts = [[k] for k in cluster] if _meets(hull, path) else []
        found += [HPolyhedron(*around(places.at[part], reach[part])) for part in parts] or [hull]
    return found


def _meets(hull: HPolyhedron, path: np.ndarray) -> bool:
    """Whether a polygon and a segment (2, 2) have a point in common: the segment is cut by each side in turn."""
    first, last = 0.0, 1.0
    for normal, offset in zip(hull.A(), hull.b(), strict=True):
        here, rise = normal @ path[0] - offset, normal @ (path[1] - path[0])
        if abs(rise) < 1e-12:
            last = last if here <= 0.0 else -1.0
        elif rise > 0.0:
            last = min(last, -here / rise)
        else:
            first = max(first, -here / rise)
    return first <= last


def domain(hand: np.ndarray, reach: float) -> HPolyhedron:
    """Return a regular polygon around what the sensor reaches."""
    return HPolyhedron(*around_discs(hand[None], np.full(1, reach)))


def about(obstacles: Obstacles, hand: np.ndarray, within: HPolyhedron) -> Region | None:
    """Return the region about the hand point; None where IRIS finds none."""
    found = _iris(obstacles, hand, within, IrisOptions(require_sample_point_is_contained=True))
    return None if found is None else _region(found, within)


def along(obstacles: Obstacles, path: np.ndarray, within: HPolyhedron) -> Region | None:
    """Return the region along a path (2, 2); about its start where it is too short, None where IRIS finds none.

    Drake ends iterations by a function in C++ alone, so they are made one by one here.
    """
    way = path[1] - path[0]
    length = float(np.linalg.norm(way))
    if length < 2.0 * SHORT:
        return about(obstacles, path[0], within)
    ends = np.array([path[0], path[1] - SHORT * way / length])

    def step(ellipse: Hyperellipsoid) -> HPolyhedron | None:
        found = _iris(obstacles, ends.mean(axis=0), within, IrisOptions(starting_ellipse=ellipse, iteration_limit=1))
        return None if found is None or np.any(ends @ found.A().T > found.b() + HELD) else found

    ellipses = (_ellipse(ends, 0.5**k) for k in range(NARROWEST))
    best, ellipse = next(((one, e) for e in ellipses if (one := step(e))), (None, None))
    usual = IrisOptions()
    for _ in range(usual.iteration_limit - 1):
        if best is None or ellipse is None:
            return None
        before, ellipse = ellipse.CalcVolume(), best.MaximumVolumeInscribedEllipsoid()
        grown = ellipse.CalcVolume() - before
        after = step(ellipse)
        if after is None or grown <= max(usual.termination_threshold, usual.relative_termination_threshold * before):
            break
        best = after
    return None if best is None else _region(best, within)


def _ellipse(ends: np.ndarray, ratio: float) -> Hyperellipsoid:
    """Return the ellipse around a segment (2, 2) whose axes have this ratio."""
    half = 0.5 * (ends[1] - ends[0])
    length = float(np.linalg.norm(half))
    frame = np.array([half, [-half[1], half[0]]]) / length
    return Hyperellipsoid(np.diag([1.0, 1.0 / ratio]) @ frame / length, ends.mean(axis=0))


def _iris(obstacles: Obstacles, sample: np.ndarray, within: HPolyhedron, options: IrisOptions) -> HPolyhedron | None:
    options.verify_domain_boundedness = False
    try:
        return Iris(obstacles, sample, within, options)
    except (RuntimeError, ValueError):
        return None


def _region(found: HPolyhedron, within: HPolyhedron) -> Region:
    """Return the half-spaces that came to those of the domain, which stand first."""
    A, b = found.A()[len(within.b()) :], found.b()[len(within.b()) :]
    length = np.linalg.norm(A, axis=1)
    return Region(A / length[:, None], b / length)
