"""Which pieces are the same wall: something may stand before the middle of it, a doorway may not."""

from __future__ import annotations

import math

from numba import njit

from pbrg_mj.perception.ends import has_gap
from pbrg_mj.perception.line_fit import extent, fit_line, is_member, weight_of
from pbrg_mj.perception.wall_fits import write_fit

SAME_WALL = math.radians(10.0)  # pieces that differ more in direction, noise apart, are never tried as one wall
NOISE_MARGIN = 4.0  # standard deviations of a point from its line, or of an angle


@njit(cache=True)
def join_walls(scan, rules, order, count, work, walls):  # pragma: no cover - compiled
    """Make collinear pieces one, longest first; return how many walls are left, listed in `work.ranking`."""
    rank_by_length(work.fits, work.ranking, walls)
    kept = 0
    for i in range(walls):
        wall = work.ranking[i]
        joined = False
        for k in range(kept):
            if _join(scan, rules, (order, 0, count, work.owner, work.ranking[k], wall), work):
                joined = True
                break
        if not joined:
            work.ranking[kept] = wall
            kept += 1
    return kept


@njit(cache=True)
def rank_by_length(fits, ranking, count):  # pragma: no cover - compiled
    """Sort the wall numbers in `ranking` by length, longest first (insertion sort: stable, and there are few)."""
    for i in range(1, count):
        wall, k = ranking[i], i
        length = fits[wall, 6] - fits[wall, 5]
        while k > 0 and fits[ranking[k - 1], 6] - fits[ranking[k - 1], 5] < length:
            ranking[k] = ranking[k - 1]
            k -= 1
        ranking[k] = wall


@njit(cache=True)
def _join(scan, rules, members, work):  # pragma: no cover - compiled
    """Add wall b of `members` to its wall a if one line without a gap goes through both; tell whether it was done."""
    a, b = members[4], members[5]
    fits, ends = work.fits, work.ends
    turn = abs(fits[b, 0] - fits[a, 0])
    if min(turn, 2.0 * math.pi - turn) > SAME_WALL + NOISE_MARGIN * math.sqrt(fits[a, 2] + fits[b, 2]):
        return False
    line = fit_line(scan, rules, members, (fits[a, 0], fits[a, 1]))
    if not _near(scan, rules, members, line):
        return False
    low, high = (a, b) if fits[a, 5] < fits[b, 5] else (b, a)
    write_fit(line, extent(scan, rules, members, line), work.joint)
    if has_gap(scan, rules, work.joint, ends[low, 1], ends[high, 0]):
        return False
    inner = fits[high, 6] < fits[low, 6]  # the one lies within the other
    ends[a, 0], ends[a, 1] = ends[low, 0], ends[low, 1] if inner else ends[high, 1]
    fits[a] = work.joint
    for i in range(members[1], members[2]):
        if is_member(members, i):
            members[3][members[0][i]] = a
    return True


@njit(cache=True)
def _near(scan, rules, members, line):  # pragma: no cover - compiled
    """Tell whether all points are on the line: within the split distance, or the noise if that is larger."""
    directions, xy = scan[1], scan[2]
    order, low, high = members[0], members[1], members[2]
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    for i in range(low, high):
        if is_member(members, i):
            b = order[i]
            w = weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c)
            if abs(nx * xy[b, 0] + ny * xy[b, 1] - c) > max(rules.split_distance, NOISE_MARGIN / math.sqrt(w)):
                return False
    return True
