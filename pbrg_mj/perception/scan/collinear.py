"""Segments of one line merged: something may hide the middle of a line, but a doorway separates two."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_ends import has_gap
from pbrg_mj.perception.scan.line_fit import extent, fit_line, incidence_cosine, residual, weight_of
from pbrg_mj.perception.scan.robust_fit import write_fit

NOISE_MARGIN = 4.0  # standard deviations of a point from its line, or of an angle


@kernel
def merge_collinear(points, params, order, work, lines):
    """Merge collinear lines, longest first; return how many lines are left, listed in `work.ranking`.

    `points` are as `write_points` writes them, `params` are LineParameters, `order` (B,) the beams, `work` is a
    LineWorkspace and `lines` the number of lines in it.
    """
    rank_by_length(work.fits, work.ranking, lines)
    kept = 0
    for i in range(lines):
        line = work.ranking[i]
        joined = False
        for k in range(kept):
            if _merge_pair(points, params, order, (work.ranking[k], line), work):
                joined = True
                break
        if not joined:
            work.ranking[kept] = line
            kept += 1
    return kept


@kernel
def rank_by_length(fits, ranking, count):
    """Sort the line numbers in `ranking` by length, longest first.

    `fits` (B, 7) are as `write_fit` writes them. Insertion sort: stable, and there are few lines.
    """
    for i in range(1, count):
        line, k = ranking[i], i
        length = fits[line, 6] - fits[line, 5]
        while k > 0 and fits[ranking[k - 1], 6] - fits[ranking[k - 1], 5] < length:
            ranking[k] = ranking[k - 1]
            k -= 1
        ranking[k] = line


@kernel
def _merge_pair(points, params, order, pair, work):
    """Merge line b of `pair` into line a if one line without a gap goes through both; return whether it did."""
    a, b = pair
    fits, ends, joint = work.fits, work.ends, work.joint
    turn = abs(fits[b, 0] - fits[a, 0])
    if min(turn, 2.0 * math.pi - turn) > params.collinear + NOISE_MARGIN * math.sqrt(fits[a, 2] + fits[b, 2]):
        return False
    members = work.members[: gather(order, work.owner, a, b, work.members)]
    line = fit_line(points, params, members, (fits[a, 0], fits[a, 1]))
    if not _near(points, params, members, line):
        return False
    write_fit(line, extent(points, params, members, line, work.at), joint)
    low, high = (a, b) if fits[a, 5] < fits[b, 5] else (b, a)
    if has_gap(points, params, joint, ends[low, 1], ends[high, 0]):
        return False
    inner = fits[high, 6] < fits[low, 6]  # the one lies within the other
    ends[a, 0], ends[a, 1] = ends[low, 0], ends[low, 1] if inner else ends[high, 1]
    for k in range(len(joint)):
        fits[a, k] = joint[k]
    for member in members:
        work.owner[member] = a
    return True


@kernel
def gather(order, owner, a, b, members):
    """Write to `members` (B,) the beams of `order` (B,) that line a or line b has by `owner` (B,); return how many."""
    count = 0
    for beam in order:
        if owner[beam] == a or owner[beam] == b:
            members[count] = beam
            count += 1
    return count


@kernel
def _near(points, params, members, line):
    """Tell whether all points are on the line: within the split distance, or the noise if that is larger."""
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    for b in members:
        off = abs(residual(points, params, nx, ny, c, b))
        if off > params.split_distance:
            w = weight_of(params, incidence_cosine(points, params, nx, ny, b), c)
            if off > NOISE_MARGIN / math.sqrt(w):
                return False
    return True
