"""Which straight pieces of a scan are walls, and which pieces are the same wall."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import chdtri

from pbrg_mj.perception.clusters import cluster
from pbrg_mj.perception.lines import Line, bend, deviations, fit_line, misfit
from pbrg_mj.perception.points import Points, scan_points
from pbrg_mj.perception.segments import Piece, split_and_merge
from pbrg_mj.perception.setup import SegmentRules

OUTLIER = 3.5  # standard deviations beyond which a point belongs to something else
MAX_OUTLIERS = 2  # a piece with more of them is no wall
FALSE_ALARM = 1e-3  # share of true walls that the test of their residuals loses, per scan
MAX_BEND = 3.0  # standard deviations of the curvature
MIN_TURN, MAX_TURN = np.deg2rad(5.0), np.deg2rad(40.0)  # between the pieces of one curved surface
SAME_WALL = np.deg2rad(10.0)  # pieces that differ more in direction are never tried as one wall


def find_walls(ranges: np.ndarray, directions: np.ndarray, rules: SegmentRules) -> list[Line]:
    """Return the walls one scan shows, in the body frame, longest first.

    `ranges` (beams,) [m] with NaN for no hit, `directions` (beams, 2) unit vectors. Robots, wheels and round things
    are no walls: they are too short, or too round for the noise.
    """
    points, clusters, ring = cluster(scan_points(ranges, directions), rules.range_std)
    pieces = split_and_merge(points.xy_body, clusters, rules.split_distance)
    curved = _curved(points.xy_body, pieces, clusters, ring)
    fits = [_wall(points.take(slice(*piece)), rules) for piece, c in zip(pieces, curved, strict=True) if not c]
    return [line for _, line in _joined([fit for fit in fits if fit is not None], rules)]


def _wall(points: Points, rules: SegmentRules) -> tuple[Points, Line] | None:
    """Return a piece without its outliers and its line, or None if it is no wall."""
    for _ in range(MAX_OUTLIERS + 1):
        if len(points) < rules.min_points or _span(points.xy_body) < rules.min_length:
            return None
        line = fit_line(points, rules.range_std)
        deviation = np.abs(deviations(line, rules.range_std))
        worst = int(np.argmax(deviation))
        if deviation[worst] <= OUTLIER:
            return (points, line) if _is_straight(line, rules.range_std) else None
        points = points.take(np.delete(np.arange(len(points)), worst))
    return None


def _span(xy: np.ndarray) -> float:
    return math.hypot(*(xy[-1] - xy[0]))


def _is_straight(line: Line, range_std: float) -> bool:
    allowed = chdtri(len(line.along) - 2, FALSE_ALARM)
    return misfit(line, range_std) <= allowed and abs(bend(line, range_std)) <= MAX_BEND


def _curved(xy: np.ndarray, pieces: list[Piece], clusters: list[Piece], ring: bool) -> np.ndarray:
    """Return (pieces,) bool: a piece that turns gently the same way into both its neighbours is part of a curve.

    Five points of a circle can pass for a straight line by themselves. Neighbours of fewer than three points have no
    direction of their own and do not count.
    """
    low, high = np.array(pieces, dtype=int).reshape(-1, 2).T
    if len(pieces) < 3:
        return np.zeros(len(pieces), dtype=bool)
    here = np.arange(len(pieces))
    after, before = (here + 1) % len(here), here - 1
    x, y = (xy[high - 1] - xy[low]).T
    turn = np.arctan2(x * y[after] - y * x[after], x * x[after] + y * y[after])
    long = high - low >= 3
    gentle = (np.abs(turn) > MIN_TURN) & (np.abs(turn) < MAX_TURN) & long & long[after]
    if not ring:
        ends = {stop for _, stop in clusters}
        gentle &= [stop not in ends for _, stop in pieces]  # else the next piece is of another cluster
    return gentle & gentle[before] & (turn * turn[before] > 0)


def _joined(fits: list[tuple[Points, Line]], rules: SegmentRules) -> list[tuple[Points, Line]]:
    """Return the walls with collinear pieces made one: something may stand before the middle of a wall."""
    walls: list[tuple[Points, Line]] = []
    for points, line in sorted(fits, key=lambda fit: -fit[1].length):
        for index, (known_points, known) in enumerate(walls):
            if abs(math.remainder(line.angle - known.angle, 2 * math.pi)) > SAME_WALL:
                continue
            both = known_points.append(points)
            joint = fit_line(both, rules.range_std, known.normal)
            if np.abs(joint.residual).max() <= rules.split_distance:
                walls[index] = (both, joint)
                break
        else:
            walls.append((points, line))
    return walls
