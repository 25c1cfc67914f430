"""What a robot's round does with what it alone knows: a gradient step of cost and rows, and of the multipliers.

`descend` for rows of rho, `descend_along` for rows that have directions. Compiled; `equations` is the specification.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel


@kernel
def descend(old, new, private, flow):
    """Take step alpha (grad f_i + grad g_i' lambda_i) from new z_i (eq. 25); write new lambda_i (eq. 29).

    Arguments: `Estimates` twice, `PrivateData`, `Flow` of `rounds`.
    """
    z, lam, new_z, new_lam = old.z, old.lam, new.z, new.lam
    leader, r, first, existing = private.leader, private.reference, private.first, private.row
    a, C, d = private.a, private.C, private.d
    alpha, step, cap = flow.alpha, flow.step, flow.multiplier_cap
    n = len(leader)
    for i in range(n):
        rho = off_x = off_y = 0.0  # nobody asks for them where there are no rows
        if first[i] < first[i + 1]:
            rho, off_x, off_y = _radius(z, i)
        pull = 0.0  # sum of a lambda: the weight of grad rho
        push_x = push_y = 0.0  # sum of C lambda
        for e in range(first[i], first[i + 1]):
            row = existing[e]
            multiplier = lam[i, row]
            pull += a[i, row] * multiplier
            push_x += C[i, row, 0] * multiplier
            push_y += C[i, row, 1] * multiplier
            g = a[i, row] * rho + C[i, row, 0] * z[i, 0] + C[i, row, 1] * z[i, 1] - d[i, row]  # eq. 13
            # eq. 29: the switch; the clip ends the last explicit step at lambda = 0, where the flow would stop
            switched = multiplier > 0.0 or g > 0.0
            new_lam[i, row] = min(max(multiplier + step * g, 0.0), cap) if switched else 0.0
        weight = pull / rho if rho > 0.0 else 0.0  # 0 is a subgradient of rho at its kink
        pulled = step * alpha * weight
        new_z[i, 0] -= step * alpha * (2.0 * leader[i] * (z[i, 0] - r[i, 0]) + push_x) + pulled * off_x
        new_z[i, 1] -= step * alpha * (2.0 * leader[i] * (z[i, 1] - r[i, 1]) + push_y) + pulled * off_y
        if pulled > 0.0:
            for c in range(2, 2 + 2 * n, 2):
                new_z[i, c] += pulled * (z[i, 0] - z[i, c])
                new_z[i, c + 1] += pulled * (z[i, 1] - z[i, c + 1])
            for c in range(2 + 2 * n, 2 + 4 * n):
                new_z[i, c] -= pulled * z[i, c]


@kernel
def _radius(z, i):
    """Return rho(m, z_p, z_xi) of robot i's estimate, and sum_j (m - z_pj)."""
    n = len(z)
    square_x = square_y = square_xi = square_eta = 0.0  # four sums that need not wait for each other
    off_x = off_y = 0.0
    for c in range(2, 2 + 2 * n, 2):
        x, y = z[i, 0] - z[i, c], z[i, 1] - z[i, c + 1]
        square_x += x * x
        square_y += y * y
        off_x += x
        off_y += y
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        square_xi += z[i, c] * z[i, c]
        square_eta += z[i, c + 1] * z[i, c + 1]
    return math.sqrt(square_x + square_y + square_xi + square_eta), off_x, off_y


@kernel
def descend_along(old, new, private, flow):
    """Do what `descend` does where each row has the motion along its own direction in place of rho.

    Neighbouring rows with one direction, such as those of one half-space, share its sums. Arguments as of `descend`;
    `private.along` is (n, R, 2).
    """
    z, lam, new_z, new_lam = old.z, old.lam, new.z, new.lam
    leader, r, first, existing = private.leader, private.reference, private.first, private.row
    a, C, d, along = private.a, private.C, private.d, private.along
    gain, step, cap = flow.step * flow.alpha, flow.step, flow.multiplier_cap
    for i in range(len(leader)):
        new_z[i, 0] -= gain * 2.0 * leader[i] * (z[i, 0] - r[i, 0])
        new_z[i, 1] -= gain * 2.0 * leader[i] * (z[i, 1] - r[i, 1])
        e = first[i]
        while e < first[i + 1]:
            G_x, G_y = along[i, existing[e], 0], along[i, existing[e], 1]
            size, total = _radius_along(z, i, G_x, G_y)
            pull = 0.0
            while e < first[i + 1] and along[i, existing[e], 0] == G_x and along[i, existing[e], 1] == G_y:
                row = existing[e]
                multiplier = lam[i, row]
                pull += a[i, row] * multiplier
                new_z[i, 0] -= gain * C[i, row, 0] * multiplier
                new_z[i, 1] -= gain * C[i, row, 1] * multiplier
                g = a[i, row] * size + C[i, row, 0] * z[i, 0] + C[i, row, 1] * z[i, 1] - d[i, row]
                switched = multiplier > 0.0 or g > 0.0  # eq. 29, as in `descend`
                new_lam[i, row] = min(max(multiplier + step * g, 0.0), cap) if switched else 0.0
                e += 1
            if pull > 0.0 and size > 0.0:  # 0 is a subgradient at the kink
                _pull_along(z, new_z, i, gain * pull / size, total, G_x, G_y)


@kernel
def _pull_along(z, new_z, i, pulled, total, G_x, G_y):
    """Take `pulled` ||x_G|| times the gradient of ||x_G|| from new_z (n, 4n + 2) of robot i.

    `total` is sum_j G.(m - z_pj).
    """
    half = z.shape[1] // 2 + 1  # where z_xi begins
    for c in range(2, half, 2):
        e = pulled * (G_x * (z[i, 0] - z[i, c]) + G_y * (z[i, 1] - z[i, c + 1]))
        new_z[i, c] += e * G_x
        new_z[i, c + 1] += e * G_y
    for c in range(half, z.shape[1], 2):
        s = pulled * (G_x * z[i, c] + G_y * z[i, c + 1])
        new_z[i, c] -= s * G_x
        new_z[i, c + 1] -= s * G_y
    new_z[i, 0] -= pulled * total * G_x
    new_z[i, 1] -= pulled * total * G_y


@kernel
def _radius_along(z, i, G_x, G_y):
    """Return ||x_G(z_i)||, and sum_j G.(m - z_pj)."""
    half = z.shape[1] // 2 + 1
    square = total = 0.0
    for c in range(2, half, 2):
        e = G_x * (z[i, 0] - z[i, c]) + G_y * (z[i, 1] - z[i, c + 1])
        total += e
        square += e * e
    for c in range(half, z.shape[1], 2):
        s = G_x * z[i, c] + G_y * z[i, c + 1]
        square += s * s
    return math.sqrt(square), total
