"""One scan to the straight walls it shows, in the body frame.

Points -> clusters (adaptive breakpoints) -> straight pieces (split and merge) -> lines (quasi-likelihood of the ranges)
-> collinear pieces made one -> what the beams beside an end say about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.collinear import gather, join_walls, rank_by_length
from pbrg_mj.perception.scan.line_ends import is_free
from pbrg_mj.perception.scan.parameters import LineRules
from pbrg_mj.perception.scan.points import points_into, without_spikes
from pbrg_mj.perception.scan.robust_fit import add_strays, fit_wall
from pbrg_mj.perception.scan.segmentation import clusters_into, is_curved, pieces_into, without_stub


@dataclass(frozen=True)
class Lines:
    """L straight walls n . p = offset in the frame of the beams, longest first; n = (cos angle, sin angle)."""

    angle: np.ndarray  # (L,) direction of the outward normal n [rad]
    offset: np.ndarray  # (L,) distance of the origin, >= 0 [m]
    covariance: np.ndarray  # (L, 2, 2) of (angle, offset) from range noise
    low: np.ndarray  # (L,) where the stretch seen begins along t = (-sin, cos) [m]
    high: np.ndarray  # (L,) where it ends [m]
    free_low: np.ndarray  # (L,) bool: the wall truly ends at `low`, beams pass by it there
    free_high: np.ndarray  # (L,) bool: the same at `high`

    def __len__(self) -> int:
        """Return L."""
        return len(self.angle)


class LineBuffer(NamedTuple):
    """Room for the lines of a scan, for compiled code: the arrays of `Lines`, whose first `count` rows are used."""

    angle: np.ndarray
    offset: np.ndarray
    covariance: np.ndarray
    low: np.ndarray
    high: np.ndarray
    free_low: np.ndarray
    free_high: np.ndarray


class Workspace(NamedTuple):
    """Room for one scan of B beams while its lines are fitted."""

    points: np.ndarray  # (B, 6) of each beam, see hits.py
    hits: np.ndarray  # (B,) beams that hit something
    kept: np.ndarray  # (B,) without lone outliers
    order: np.ndarray  # (B,) turned so that no cluster wraps
    stops: np.ndarray  # (B,) where clusters stop in `order`
    stack: np.ndarray  # (B + 2, 2) pieces still to split
    pieces: np.ndarray  # (B, 3) start, stop in `order`, cluster
    members: np.ndarray  # (B,) beams of the wall at hand
    at: np.ndarray  # (B, 4) where they meet its line
    owner: np.ndarray  # (B,) wall that has a beam's point, -1: none
    fits: np.ndarray  # (B, 7) theta, c, var theta, cov, var c, low, high of each wall
    ends: np.ndarray  # (B, 2) beams of each wall's first and last point
    ranking: np.ndarray  # (B,) walls, longest first
    joint: np.ndarray  # (7,) the fit of two pieces that may be one wall


@kernel
def line_buffer(beams):  # pragma: no cover - compiled
    """Return room for all lines that a scan of so many beams can have: each takes three points at least."""
    most = beams // 3 + 1
    angle, offset, covariance = np.empty(most), np.empty(most), np.empty((most, 2, 2))
    low, high = np.empty(most), np.empty(most)
    return LineBuffer(angle, offset, covariance, low, high, np.empty(most, np.bool_), np.empty(most, np.bool_))


@kernel
def workspace(beams):  # pragma: no cover - compiled
    """Return room for scans of so many beams."""
    return Workspace(
        points=np.empty((beams, 6)),
        hits=np.empty(beams, np.int64),
        kept=np.empty(beams, np.int64),
        order=np.empty(beams, np.int64),
        stops=np.empty(beams, np.int64),
        stack=np.empty((beams + 2, 2), np.int64),
        pieces=np.empty((beams, 3), np.int64),
        members=np.empty(beams, np.int64),
        at=np.empty((beams, 4)),
        owner=np.empty(beams, np.int64),
        fits=np.empty((beams, 7)),
        ends=np.empty((beams, 2), np.int64),
        ranking=np.empty(beams, np.int64),
        joint=np.empty(7),
    )


def scan_lines(ranges: np.ndarray, directions: np.ndarray, rules: LineRules) -> Lines:
    """Return the walls of one scan: ranges (beams,) [m], NaN for no hit; directions (beams, 2) unit vectors.

    The beams are in counter-clockwise order, evenly spread. Anything in a scan is allowed: what is no wall gives
    no line.
    """
    out = line_buffer(len(ranges))
    count = scan_lines_into(ranges, directions, rules, workspace(len(ranges)), out)
    return Lines(*(array[:count] for array in out))


@kernel
def scan_lines_into(ranges, directions, rules, work, out):  # pragma: no cover - compiled
    """Write the walls of one scan to `out` (LineBuffer), longest first; return how many there are.

    `ranges` (beams,) and `directions` (beams, 2) are contiguous floats, `work` is a Workspace. Nothing is allocated.
    """
    points = work.points
    hits = points_into(ranges, directions, rules, points, work.hits)
    count = without_spikes(points, rules, work.hits, hits, work.kept)
    clusters, ring = clusters_into(points, rules, work.kept, count, work.order, work.stops, work.members)
    order = work.order[:count]
    pieces = pieces_into(points, rules, order, clusters, work)
    walls = _fit_walls(rules, order, (pieces, ring), work)
    walls = join_walls(points, rules, order, work, walls)
    rank_by_length(work.fits, work.ranking, walls)
    for i in range(walls):
        wall = work.ranking[i]
        if rules.strays > 0.0:
            members = work.members[: gather(order, work.owner, wall, wall, work.members)]
            add_strays(points, rules, members, work.at, work.fits[wall])
        _write_line(rules, work, wall, out, i)
    return walls


@kernel
def _fit_walls(rules, order, found, work):  # pragma: no cover - compiled
    """Fit all pieces that are not curved; return how many are walls, listed in `work.ranking`."""
    points, (pieces, ring) = work.points, found
    work.owner[:] = -1
    walls = 0
    for i in range(pieces):
        if is_curved(points, order, work.pieces, pieces, ring, i):
            continue
        start, stop = without_stub(points, rules, order, work.pieces[i])
        members = work.members[: stop - start]
        members[:] = order[start:stop]
        count = fit_wall(points, rules, members, work.at, work.fits[i])
        if count > 0:
            work.ends[i, 0], work.ends[i, 1] = members[0], members[count - 1]
            work.ranking[walls] = i
            walls += 1
        for b in members[:count]:
            work.owner[b] = i
    return walls


@kernel
def _write_line(rules, work, wall, out, i):  # pragma: no cover - compiled
    fit = work.fits[wall]
    out.angle[i], out.offset[i], out.low[i], out.high[i] = fit[0], fit[1], fit[5], fit[6]
    out.covariance[i, 0, 0], out.covariance[i, 1, 1] = fit[2], fit[4]
    out.covariance[i, 0, 1] = out.covariance[i, 1, 0] = fit[3]
    out.free_low[i] = is_free(work.points, rules, fit, work.ends[wall, 0], -1)
    out.free_high[i] = is_free(work.points, rules, fit, work.ends[wall, 1], 1)
