"""When a robot suspects that no reference is admissible: by the states it believes in, an own row cannot be met.

Over all m a row a rho + C m - d is least at a s sqrt(1 - ||C||^2 / (n a^2)) + C mean p - d, with s^2 = sum ||p_j - mean
p||^2 + ||xi||^2. Above 0 no m meets it. At the true states that is a proof; at a robot's estimates, which lag the team
and which multipliers bend, it is a suspicion. docs/failure-modes.md has how often it is right. Rows
with directions G have the part of s along G.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

ROUNDING = 1e-9  # [m]


@kernel
def some_row_is_infeasible(z, a, C, d, active, along):
    """Return whether some robot has a row that no m meets at its estimates z (n, 4n + 2).

    The rest are `Rows`: a (n, R), C (n, R, 2), d (n, R), active (n, R), along (n, R, 2) or (0, 0, 2).
    """
    n = len(z)
    for i in range(n):
        s = mean_x = mean_y = -1.0  # not computed yet
        for row in range(a.shape[1]):
            if not active[i, row]:
                continue
            if len(along) > 0:
                s, mean_x, mean_y = _spread_along(z, i, along[i, row, 0], along[i, row, 1])
            elif s < 0.0:
                s, mean_x, mean_y = _spread(z, i)
            least = a[i, row] ** 2 - (C[i, row, 0] ** 2 + C[i, row, 1] ** 2) / n
            if least >= 0.0:  # else there is no least value
                value = math.sqrt(least) * s + C[i, row, 0] * mean_x + C[i, row, 1] * mean_y - d[i, row]
                if value > ROUNDING:
                    return True
    return False


@kernel
def _mean(z, i):
    """Return the mean of z_p of robot i's estimates."""
    n = len(z)
    x = y = 0.0
    for c in range(2, 2 + 2 * n, 2):
        x += z[i, c] / n
        y += z[i, c + 1] / n
    return x, y


@kernel
def _spread(z, i):
    """Return s and the mean of z_p of robot i's estimates."""
    n, square = len(z), 0.0
    mean_x, mean_y = _mean(z, i)
    for c in range(2, 2 + 2 * n, 2):
        square += (z[i, c] - mean_x) ** 2 + (z[i, c + 1] - mean_y) ** 2
    for c in range(2 + 2 * n, 2 + 4 * n):
        square += z[i, c] ** 2
    return math.sqrt(square), mean_x, mean_y


@kernel
def _spread_along(z, i, G_x, G_y):
    """Return s along G, and the mean of z_p, of robot i's estimates."""
    n, square = len(z), 0.0
    mean_x, mean_y = _mean(z, i)
    for c in range(2, 2 + 2 * n, 2):
        square += (G_x * (z[i, c] - mean_x) + G_y * (z[i, c + 1] - mean_y)) ** 2
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        square += (G_x * z[i, c] + G_y * z[i, c + 1]) ** 2
    return math.sqrt(square), mean_x, mean_y
