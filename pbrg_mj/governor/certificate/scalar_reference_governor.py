"""The scalar reference governor: the largest step kappa from the held m to a candidate that the rows allow.

m(k + 1) = m(k) + kappa (candidate - m(k)) with kappa in [0, 1] (Gilbert, Kolmanovsky and Tan, Int. J. Robust and
Nonlinear Control 5, 1995), here by closed form.

On the way m(k) = held + k v the radius of the paper's ball is rho^2 = rho_0^2 + 2 b k + c k^2 with
b = n (held - mean).v and c = n ||v||^2, so that a row a rho + C.m <= d asks for

    a sqrt(rho_0^2 + 2 b k + c k^2) <= D - E k,     D = d - C.held,     E = C.v:

an interval of k between the roots of a parabola, or with a = 0, the rows of the directional ball and of the prediction,
a half-line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel

ROUNDING = 1e-9  # [m] by which a row may be violated at the held m
LINEAR_TOLERANCE = 1e-12  # of a parabola's first coefficient over c: a straight line


class Spread(NamedTuple):
    """All that rho knows of a team: rho(m)^2 = robots ||m - mean||^2 + square."""

    robots: float
    mean: np.ndarray  # (2,) of p [m]
    square: float  # [m^2]

    @classmethod
    def of(cls, p: np.ndarray, xi: np.ndarray) -> Spread:
        """Return the spread of states p, xi (n, 2) [m]."""
        mean = p.mean(axis=0)
        return cls(float(len(p)), mean, float(np.sum((p - mean) ** 2) + np.sum(xi**2)))


def largest_kappa(rows: Rows, spread: Spread, held: np.ndarray, candidate: np.ndarray) -> tuple[float, bool]:
    """Return kappa in [0, 1], and whether all rows hold at the held m; where one does not, kappa is 0.

    `held` and `candidate` are (2,) [m].
    """
    active = rows.active
    return _largest_kappa((rows.a[active], rows.C[active], rows.d[active]), tuple(spread), held, candidate)


@kernel
def _largest_kappa(rows, spread, held, candidate):
    """Return what `largest_kappa` does.

    `rows` are those active, a (R,), C (R, 2), d (R,); `spread` the members of `Spread`: n robots, mean (2,), square
    [m^2]; held (2,), candidate (2,) [m].
    """
    a, C, d = rows
    n, mean, square = spread
    x, y = held[0] - mean[0], held[1] - mean[1]
    vx, vy = candidate[0] - held[0], candidate[1] - held[1]
    radius = math.sqrt(n * (x * x + y * y) + square)
    b, c = n * (x * vx + y * vy), n * (vx * vx + vy * vy)
    kappa = 1.0
    for r in range(len(d)):
        slack = d[r] - (C[r, 0] * held[0] + C[r, 1] * held[1])
        if slack < a[r] * radius - ROUNDING:
            return 0.0, False
        rise = C[r, 0] * vx + C[r, 1] * vy
        kappa = min(kappa, kappa_of_row(a[r], slack, rise, radius, b, c))
    return kappa, True


@kernel
def kappa_of_row(a, slack, rise, radius, b, c):
    """Return the largest k in [0, 1] with a sqrt(radius^2 + 2 b k + c k^2) <= slack - rise k; it holds at k = 0."""
    if a == 0.0 or c == 0.0:
        return min(1.0, max(slack, 0.0) / rise) if rise > 0.0 else 1.0
    if a * math.sqrt(max(radius * radius + 2.0 * b + c, 0.0)) <= slack - rise:
        return 1.0  # the rows are convex
    first, half = a * a * c - rise * rise, a * a * b + slack * rise
    last = min(a * a * radius * radius - slack * slack, 0.0)
    if first > LINEAR_TOLERANCE * c:
        root = math.sqrt(max(half * half - first * last, 0.0))
        found = -last / (half + root) if half > 0.0 else (root - half) / first
    else:
        found = -last / (2.0 * half) if half > 0.0 else 1.0
    if rise > 0.0:
        found = min(found, slack / rise)  # the squares also hold beyond
    return min(max(found, 0.0), 1.0)
