"""Clusters: consecutive points that may lie on one surface."""

from __future__ import annotations

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.hits import R, apart


@kernel
def clusters_into(points, rules, order, count, turned, stops, breaks):  # pragma: no cover - compiled
    """Write the points turned so that no cluster wraps, and where each cluster stops; return (clusters, ring).

    `breaks` (B,) is scratch.

    In a ring no neighbours are apart: everything around is one cluster, whose last point is next to its first. It is
    then cut at the point farthest away, which is a corner if there is any.
    """
    first, ring = _first(points, rules, order, count, breaks)
    clusters = 0
    for i in range(count):
        k = first + i if first + i < count else first + i - count
        turned[i] = order[k]
        if i == count - 1 or breaks[k]:
            stops[clusters] = i + 1
            clusters += 1
    return clusters, ring


@kernel
def _first(points, rules, order, count, breaks):  # pragma: no cover - compiled
    """Return where to begin, and whether the points form a ring; write to `breaks` after which points it is broken."""
    first = farthest = -1
    for i in range(count):
        after = i + 1 if i + 1 < count else 0
        breaks[i] = _broken(points, rules, order, i, after)
        if breaks[i]:
            first = after
        if farthest < 0 or points[order[i], R] > points[order[farthest], R]:
            farthest = i
    return (first, False) if first >= 0 else (farthest, True)


@kernel
def _broken(points, rules, order, i, after):  # pragma: no cover - compiled
    """Tell whether the i-th point and the one after it are apart.

    Lone outliers taken out in between do not count if they are nearer: then they hide the surface, as does the robot
    itself. A beam that went farther, like one that returned nothing, did not meet it.
    """
    a, z = order[i], order[after]
    nearer = 0
    for k in range(a + 1, z if z >= a else z + len(points)):
        if points[k if k < len(points) else k - len(points), R] < max(points[a, R], points[z, R]):
            nearer += 1
    return apart(points, rules, a, z, nearer)
