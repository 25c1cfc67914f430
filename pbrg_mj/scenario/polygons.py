"""Simple polygons in convex parts: triangles by ear clipping, joined across diagonals while they stay convex.

Joined so, there are at most four times as many parts as in the best partition (Hertel and Mehlhorn, "Fast triangulation
of simple polygons", 1983).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations

Point = tuple[float, float]
Polygon = tuple[Point, ...]

MIN_CORNER_SINE = 1e-6  # sine of the turn at a corner
SHORTEST = 1e-6  # side [m]
FLATTEST = 1e-6  # least over greatest extent of what MuJoCo takes as a mesh: below 1e-7 its hull is not found


def is_simple(corners: Polygon) -> bool:
    """Whether corners, taken in turn, go once around a polygon whose sides meet at its corners alone and turn there."""
    sides = [(corners[k], corners[(k + 1) % len(corners)]) for k in range(len(corners))]
    lengths = [_length(*side) for side in sides]
    if min(lengths) < SHORTEST:
        return False
    for k in range(len(corners)):
        turn = _cross(corners[k - 1], corners[k], corners[(k + 1) % len(corners)])
        if abs(turn) <= MIN_CORNER_SINE * lengths[k - 1] * lengths[k]:
            return False
    apart = ((i, j) for i, j in combinations(range(len(sides)), 2) if j - i not in (1, len(sides) - 1))
    return not any(_meet(*sides[i], *sides[j]) for i, j in apart)


@lru_cache(maxsize=500)  # a whole world's prisms, `MOST_OBSTACLES`, each asked for several times; studies draw new ones
def convex_parts(corners: Polygon) -> tuple[Polygon, ...]:
    """Return convex polygons, counter-clockwise, that make up a simple polygon; their corners are its own.

    A convex polygon is its only part, as it was given. Raises ValueError for a polygon that is not simple.
    """
    if not is_simple(corners):
        raise ValueError("the sides of this polygon meet or do not turn")
    if _is_convex(corners) or _is_convex(corners[::-1]):
        return (corners,)
    turned = corners if _area(corners) > 0.0 else corners[::-1]
    return tuple(tuple(turned[k] for k in part) for part in _joined(_triangles(turned), turned))


def _triangles(corners: Polygon) -> list[list[int]]:
    """Return a counter-clockwise polygon's triangles as indices of corners."""
    left, triangles = list(range(len(corners))), []
    while len(left) > 3:
        ear = max(
            (k for k in range(len(left)) if _is_ear(corners, left, k)), key=lambda k: _ear_quality(corners, left, k)
        )
        triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return [*triangles, left]


def _is_ear(corners: Polygon, left: list[int], k: int) -> bool:
    """Whether the triangle at a corner that is left turns left and holds no other one."""
    a, b, c = (corners[left[i % len(left)]] for i in (k - 1, k, k + 1))
    if _cross(a, b, c) <= 0.0:
        return False
    others = (corners[i] for i in left if corners[i] not in (a, b, c))
    return not any(min(_cross(a, b, p), _cross(b, c, p), _cross(c, a, p)) >= 0.0 for p in others)


def _ear_quality(corners: Polygon, left: list[int], k: int) -> float:
    """Return twice an ear's area per its longest side squared: slivers come last."""
    a, b, c = (corners[left[i % len(left)]] for i in (k - 1, k, k + 1))
    return _cross(a, b, c) / max(_length(a, b), _length(b, c), _length(c, a)) ** 2


def _joined(parts: list[list[int]], corners: Polygon) -> list[list[int]]:
    """Join two parts that share a side while there are two whose union is convex."""
    for i, j in combinations(range(len(parts)), 2):
        union = _union(parts[i], parts[j])
        if union and _is_convex(tuple(corners[k] for k in union)):
            return _joined([union, *(part for n, part in enumerate(parts) if n not in (i, j))], corners)
    return parts


def _union(first: list[int], second: list[int]) -> list[int]:
    """Return two counter-clockwise parts as one around the side that they share; empty if they share none."""
    for k, end in enumerate(first):
        start = first[k - 1]
        if start in second and second[second.index(start) - 1] == end:
            at = second.index(start)
            return [*first[k:], *first[:k], *(second[at + 1 :] + second[:at])[:-1]]
    return []


def _is_convex(corners: Polygon) -> bool:
    """Whether a polygon that goes around once turns left at every corner."""
    turns = [_cross(corners[k - 2], corners[k - 1], corners[k]) for k in range(len(corners))]
    return all(turn > 0.0 for turn in turns)


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether two sides that share no corner touch."""
    one, two, three, four = _cross(a, b, c), _cross(a, b, d), _cross(c, d, a), _cross(c, d, b)
    if max(one, two) < 0.0 or min(one, two) > 0.0 or max(three, four) < 0.0 or min(three, four) > 0.0:
        return False
    boxes = [(min(p[i], q[i]), max(p[i], q[i])) for p, q in ((a, b), (c, d)) for i in (0, 1)]
    return all(boxes[i][0] <= boxes[i + 2][1] and boxes[i + 2][0] <= boxes[i][1] for i in (0, 1))


def flatness(corners: Polygon, height: float) -> float:
    """Return at most the least over the greatest extent of an upright prism on a convex polygon; both sizes in m."""
    diagonal = max(_length(*pair) for pair in combinations(corners, 2))
    return min(abs(_area(corners)) / diagonal, height) / max(diagonal, height)


def _area(corners: Polygon) -> float:
    """Return a polygon's area, positive where it goes around counter-clockwise."""
    return 0.5 * sum(_cross((0.0, 0.0), corners[k - 1], corners[k]) for k in range(len(corners)))


def _cross(a: Point, b: Point, c: Point) -> float:
    """Return how far c lies to the left of the line from a to b, times its length."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _length(a: Point, b: Point) -> float:
    return ((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2) ** 0.5
