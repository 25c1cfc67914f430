"""One scan to the straight lines it shows, in the body frame.

Points -> clusters (adaptive breakpoints) -> straight segments (split and merge) -> lines (quasi-likelihood of the
ranges) -> collinear lines merged -> points beside corners settled -> covariances that count outliers and points of
other walls -> free ends, where the beams beside them pass by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.collinear import gather, merge_collinear, rank_by_length
from pbrg_mj.perception.scan.corners import settle_corners
from pbrg_mj.perception.scan.joined_ends import allow_for_corners
from pbrg_mj.perception.scan.line_ends import is_free
from pbrg_mj.perception.scan.parameters import LineParameters
from pbrg_mj.perception.scan.points import without_outliers, write_points
from pbrg_mj.perception.scan.robust_fit import fit_segment, inflate_for_outliers
from pbrg_mj.perception.scan.segmentation import is_curved, trim_stub, write_clusters, write_segments


@dataclass(frozen=True)
class Lines:
    """L straight lines n . p = offset in the frame of the beams, longest first; n = (cos angle, sin angle)."""

    angle: np.ndarray  # (L,) direction of the outward normal n [rad]
    offset: np.ndarray  # (L,) distance of the origin, >= 0 [m]
    covariance: np.ndarray  # (L, 2, 2) of (angle, offset) from range noise, by which lines are weighted
    error_covariance: np.ndarray  # (L, 2, 2) of their errors
    low: np.ndarray  # (L,) where the extent seen begins along t = (-sin, cos) [m]
    high: np.ndarray  # (L,) where it ends [m]
    free_low: np.ndarray  # (L,) bool: the line truly ends at `low`, beams pass by it there
    free_high: np.ndarray  # (L,) bool: the same at `high`

    def __len__(self) -> int:
        """Return L."""
        return len(self.angle)


class LineBuffer(NamedTuple):
    """Arrays for the lines of a scan, for compiled code: those of `Lines`, whose first `count` rows are used."""

    angle: np.ndarray
    offset: np.ndarray
    covariance: np.ndarray
    error_covariance: np.ndarray
    low: np.ndarray
    high: np.ndarray
    free_low: np.ndarray
    free_high: np.ndarray


class LineWorkspace(NamedTuple):
    """Scratch arrays for one scan of B beams while its lines are fitted."""

    points: np.ndarray  # (B, 6) of each beam, see points.py
    hits: np.ndarray  # (B,) beams that hit something
    kept: np.ndarray  # (B,) without lone outliers
    order: np.ndarray  # (B,) turned so that no cluster wraps
    stops: np.ndarray  # (B,) where clusters stop in `order`
    stack: np.ndarray  # (B + 2, 2) segments still to split
    segments: np.ndarray  # (B, 3) start, stop in `order`, cluster
    members: np.ndarray  # (B,) beams of one line
    at: np.ndarray  # (B, 4) where they meet its line
    owner: np.ndarray  # (B,) line that has a beam's point, -1: none
    fits: np.ndarray  # (B, 10) theta, c, var theta, cov, var c, low, high of each line; aa, ac, cc of its errors
    ends: np.ndarray  # (B, 2) beams of each line's first and last point
    ranking: np.ndarray  # (B,) lines, longest first
    moved: np.ndarray  # (B,) bool: points beside a line's corner have changed hands
    odds: np.ndarray  # (B,) odds that a line's last point is of the surface that is joined to it there
    joint: np.ndarray  # (7,) the fit of two segments that may be one line


@kernel
def line_buffer(beams):
    """Return a LineBuffer for all lines that a scan of so many beams can have: each takes three points at least."""
    most = beams // 3 + 1
    angle, offset, low, high = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    covariance, errors = np.empty((most, 2, 2)), np.empty((most, 2, 2))
    return LineBuffer(angle, offset, covariance, errors, low, high, np.empty(most, np.bool_), np.empty(most, np.bool_))


@kernel
def line_workspace(beams):
    """Return a LineWorkspace for scans of so many beams."""
    return LineWorkspace(
        points=np.empty((beams, 6)),
        hits=np.empty(beams, np.int64),
        kept=np.empty(beams, np.int64),
        order=np.empty(beams, np.int64),
        stops=np.empty(beams, np.int64),
        stack=np.empty((beams + 2, 2), np.int64),
        segments=np.empty((beams, 3), np.int64),
        members=np.empty(beams, np.int64),
        at=np.empty((beams, 4)),
        owner=np.empty(beams, np.int64),
        fits=np.empty((beams, 10)),
        ends=np.empty((beams, 2), np.int64),
        ranking=np.empty(beams, np.int64),
        moved=np.empty(beams, np.bool_),
        odds=np.empty(beams),
        joint=np.empty(7),
    )


def extract_lines(ranges: np.ndarray, directions: np.ndarray, params: LineParameters) -> Lines:
    """Return the lines of one scan: ranges (beams,) [m], NaN for no hit; directions (beams, 2) unit vectors.

    The beams are in counter-clockwise order, evenly spread. Any scan is allowed: what is not straight gives no
    line.
    """
    out = line_buffer(len(ranges))
    count = write_lines(ranges, directions, params, line_workspace(len(ranges)), out)
    return Lines(*(array[:count] for array in out))


@kernel
def write_lines(ranges, directions, params, work, out):
    """Write the lines of one scan to `out` (LineBuffer), longest first; return how many there are.

    `ranges` (beams,) and `directions` (beams, 2) are contiguous floats, `work` is a LineWorkspace.
    """
    points = work.points
    hits = write_points(ranges, directions, params, points, work.hits)
    count = without_outliers(points, params, work.hits, hits, work.kept)
    clusters, ring = write_clusters(points, params, work.kept, count, work.order, work.stops, work.members)
    order = work.order[:count]
    segments = write_segments(points, params, order, clusters, work)
    lines = _fit_segments(params, order, (segments, ring), work)
    lines = merge_collinear(points, params, order, work, lines)
    settle_corners(points, params, order, work, lines)
    rank_by_length(work.fits, work.ranking, lines)
    for i in range(lines):
        line = work.ranking[i]
        count = gather(order, work.owner, line, line, work.members)
        if params.outlier_density > 0.0:
            inflate_for_outliers(points, params, work.members[:count], work.at, work.fits[line])
        allow_for_corners(points, params, order, line, count, work)
        _write_line(params, work, line, out, i)
    return lines


@kernel
def _fit_segments(params, order, found, work):
    """Fit all segments that are not curved; return how many are lines, listed in `work.ranking`.

    `found` are how many segments there are, and whether they form a ring.
    """
    points, (segments, ring) = work.points, found
    for b in range(len(work.owner)):
        work.owner[b] = -1
    lines = 0
    for i in range(segments):
        if is_curved(points, params, order, work.segments, segments, ring, i):
            continue
        start, stop = trim_stub(points, params, order, work.segments[i])
        members = work.members[: stop - start]
        for k in range(stop - start):
            members[k] = order[start + k]
        count = fit_segment(points, params, members, work.at, work.fits[i])
        if count > 0:
            work.ends[i, 0], work.ends[i, 1] = members[0], members[count - 1]
            work.ranking[lines] = i
            lines += 1
        for b in members[:count]:
            work.owner[b] = i
    return lines


@kernel
def _write_line(params, work, line, out, i):
    fit = work.fits[line]
    out.angle[i], out.offset[i], out.low[i], out.high[i] = fit[0], fit[1], fit[5], fit[6]
    out.covariance[i, 0, 0], out.covariance[i, 1, 1] = fit[2], fit[4]
    out.covariance[i, 0, 1] = out.covariance[i, 1, 0] = fit[3]
    out.error_covariance[i, 0, 0], out.error_covariance[i, 1, 1] = fit[7], fit[9]
    out.error_covariance[i, 0, 1] = out.error_covariance[i, 1, 0] = fit[8]
    out.free_low[i] = is_free(work.points, params, fit, work.ends[line, 0], -1)
    out.free_high[i] = is_free(work.points, params, fit, work.ends[line, 1], 1)
