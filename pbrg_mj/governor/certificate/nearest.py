"""The nearest reference to a target that rows a rho + C.m <= d allow, rho known by the team's spread.

Rows with a = 0 are half-planes. The others are convex: where one is violated at m, its tangent there is a half-plane
that holds wherever it does. So the nearest point of half-planes and tangents, with a new tangent at every point found
outside, comes to the nearest point of the rows (Kelley 1960), in the plane within a few steps.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.governor.certificate.projection import least_violating, nearest_allowed, search_radius
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel

TANGENTS = 64  # most, of all rows together
TOLERANCE = 1e-9  # [m] by which a row may be violated at the point found


def nearest_admissible(rows: Rows, spread: Spread, target: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return m (2,) [m], and whether some reference is admissible.

    Where none is, and rows have rho in them, m is the nearest that all would allow in formation, rho = 0, by as much as
    the worst of them is violated at the mean of p: a team that comes there has something to spare, and rests nowhere
    else. Of half-planes alone m is the nearest of those that violate the worst one least.
    """
    active = rows.active
    x, y, found = _nearest((rows.a[active], rows.C[active], rows.d[active]), tuple(spread), target)
    return np.array([x, y]), found


def nearest_retreat(rows: Rows, spread: Spread, held: np.ndarray, reach: float) -> tuple[np.ndarray, Status]:
    """Return the admissible m (2,) [m] nearest to the held one, if there is one near the mean of p.

    Rows that contradict each other leave m to far places alone (`search_radius`, and beyond `reach` [m]): then m goes
    towards what `nearest_admissible` says, so far from the mean of p as that.
    """
    mean = np.array(spread.mean)
    slack = rows.d - rows.a * math.sqrt(spread.square) - rows.C @ mean
    radius = search_radius(slack[rows.active], reach)
    near, found = nearest_admissible(rows, spread, mean)
    m, _ = nearest_admissible(rows, spread, held)
    if found and math.hypot(*(near - mean).tolist()) <= radius:
        return m, "ok"
    share = min(1.0, radius / max(math.hypot(*(m - mean).tolist()), TOLERANCE))
    return mean + share * (m - mean), "inadmissible" if found else "infeasible"


@kernel
def _nearest(rows, spread, target):
    """Return x, y of the admissible m nearest to `target` (2,) [m], and whether there is one.

    `rows` are those active, a (R,), C (R, 2), d (R,); `spread` the members of `Spread`: n robots, mean (2,), square.
    """
    a, C, d = rows
    n, mean, square = spread
    normals, offsets = np.zeros((len(d) + TANGENTS, 2)), np.zeros(len(d) + TANGENTS)  # seen from the target
    count = 0
    for r in range(len(d)):
        if a[r] == 0.0:
            normals[count] = C[r]
            offsets[count] = d[r] - (C[r, 0] * target[0] + C[r, 1] * target[1])
            count += 1
    x = y = 0.0
    for _ in range(TANGENTS):
        found, x, y = nearest_allowed(0.0, 0.0, normals[:count], offsets[:count], 0.0)
        if not found:
            break
        worst, which = TOLERANCE, -1
        dx, dy = x + target[0] - mean[0], y + target[1] - mean[1]
        radius = math.sqrt(n * (dx * dx + dy * dy) + square)
        for r in range(len(d)):
            value = a[r] * radius + C[r, 0] * (x + target[0]) + C[r, 1] * (y + target[1]) - d[r]
            if a[r] > 0.0 and value > worst:
                worst, which = value, r
        if which < 0:
            return x + target[0], y + target[1], True
        along = a[which] * n / radius if radius > 0.0 else 0.0
        gx, gy = along * dx + C[which, 0], along * dy + C[which, 1]
        length = math.sqrt(gx * gx + gy * gy)
        if length < TOLERANCE:
            break  # the least value of this row, and still positive
        normals[count, 0], normals[count, 1] = gx / length, gy / length
        offsets[count] = (gx * x + gy * y - worst) / length
        count += 1
    else:
        return x + target[0], y + target[1], True  # all tangents used: as near as they come
    x, y = _in_formation(rows, mean, square, target)
    return x, y, False


@kernel
def _in_formation(rows, mean, square, target):
    """Return the nearest m where nothing is admissible.

    Arguments: a (R,), C (R, 2), d (R,), mean (2,), target (2,), square [m^2].
    """
    a, C, d = rows
    worst, cones = 0.0, False
    for r in range(len(d)):
        worst = max(worst, a[r] * math.sqrt(square) + C[r, 0] * mean[0] + C[r, 1] * mean[1] - d[r])
        cones |= a[r] > 0.0
    normals, offsets = np.zeros((len(d), 2)), np.zeros(len(d))
    count = 0
    for r in range(len(d)):
        if C[r, 0] != 0.0 or C[r, 1] != 0.0:
            normals[count] = C[r]
            offsets[count] = d[r] - (C[r, 0] * target[0] + C[r, 1] * target[1]) - (worst if a[r] > 0.0 else 0.0)
            count += 1
    found, x, y = nearest_allowed(0.0, 0.0, normals[:count], offsets[:count], 0.0)
    if not found or not cones:
        x, y = least_violating(normals[:count], offsets[:count], np.inf)
    return x + target[0], y + target[1]
