"""What a robot's proximal round does with what it alone knows: `descend` and the pinned states, taken implicitly.

Compiled; `equations.proximal_step` is the specification and says which equations are solved. All of them follow from
one number s in [0, 1], the share of their way by which the pull of rho draws z_p towards m and z_xi towards 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pbrg_mj.kernel import kernel

MOST_STEPS = 160  # of the search for s; every third halves its interval
RESOLUTION = 1e-15  # of s


class ReferenceTerms(NamedTuple):
    """Where robot i's estimate would go if rho had no pull: m (v_x, v_y) / stiffness, and z_p about its mean."""

    v_x: float
    v_y: float
    stiffness: float  # 1 + 2 step alpha delta_i
    mean_x: float
    mean_y: float
    square: float  # sum_j ||v_pj - mean||^2 + ||v_xi||^2


@kernel
def descend_proximally(old, new, private, flow):
    """Turn new z_i, where the links take z_i, into z_i+; write new lambda_i and nu_i.

    Arguments: `Estimates` twice, `PrivateData`, `Flow` of `rounds`.
    """
    z, new_z, p, xi, step = old.z, new.z, private.p, private.xi, flow.step
    n, gain = len(p), flow.step * flow.alpha
    for i in range(n):
        for axis in range(2):
            new_z[i, 2 + 2 * i + axis] -= gain * old.nu[i, axis]
            new_z[i, 2 + 2 * n + 2 * i + axis] -= gain * old.nu[i, 2 + axis]
        terms = _reference_terms(old, new, private, gain, i)
        share = _solve_share(old, new, private, flow, terms, i)
        m_x, m_y = _reference(terms, share, n)
        new_z[i, 0], new_z[i, 1] = m_x, m_y
        if share > 0.0:
            for c in range(2, 2 + 2 * n, 2):
                new_z[i, c] += share * (m_x - new_z[i, c])
                new_z[i, c + 1] += share * (m_y - new_z[i, c + 1])
            for c in range(2 + 2 * n, 2 + 4 * n):
                new_z[i, c] *= 1.0 - share
        for axis in range(2):
            at_p, at_xi = 2 + 2 * i + axis, 2 + 2 * n + 2 * i + axis
            new.nu[i, axis] = old.nu[i, axis] + step * (2.0 * new_z[i, at_p] - z[i, at_p] - p[i, axis])
            new.nu[i, 2 + axis] = old.nu[i, 2 + axis] + step * (2.0 * new_z[i, at_xi] - z[i, at_xi] - xi[i, axis])


@kernel
def _reference_terms(old, new, private, gain, i):
    """Return the `ReferenceTerms` of robot i from new z_i."""
    new_z, n, pull = new.z, len(new.z), 2.0 * gain * private.leader[i]
    v_x, v_y = new_z[i, 0], new_z[i, 1]
    if pull > 0.0:
        v_x += pull * private.reference[i, 0]
        v_y += pull * private.reference[i, 1]
    for e in range(private.first[i], private.first[i + 1]):
        row = private.row[e]
        v_x -= gain * private.C[i, row, 0] * old.lam[i, row]
        v_y -= gain * private.C[i, row, 1] * old.lam[i, row]
    mean_x = mean_y = square = 0.0
    if private.first[i] < private.first[i + 1]:  # nobody asks for them where there are no rows
        for c in range(2, 2 + 2 * n, 2):
            mean_x += new_z[i, c] / n
            mean_y += new_z[i, c + 1] / n
        for c in range(2, 2 + 2 * n, 2):
            square += (new_z[i, c] - mean_x) ** 2 + (new_z[i, c + 1] - mean_y) ** 2
        for c in range(2 + 2 * n, 2 + 4 * n):
            square += new_z[i, c] * new_z[i, c]
    return ReferenceTerms(v_x, v_y, 1.0 + pull, mean_x, mean_y, square)


@kernel
def _reference(terms, share, n):
    """Return m+ at a share."""
    weight, stiffness = share * n, terms.stiffness + share * n
    return (terms.v_x + weight * terms.mean_x) / stiffness, (terms.v_y + weight * terms.mean_y) / stiffness


@kernel
def _solve_share(old, new, private, flow, terms, i):
    """Return the share at which pull and way agree, and write new lambda_i there.

    False position, with the weight of the end that stays halved (Illinois), and every third time the middle.
    """
    low, high = 0.0, 1.0
    below = _excess(old, new, private, flow, terms, i, low)
    if below >= 0.0:
        return low
    above = _excess(old, new, private, flow, terms, i, high)
    if above <= 0.0:
        return high
    share, kept = low, 0
    for count in range(MOST_STEPS):
        share = high - above * (high - low) / (above - below)
        if count % 3 == 2 or not low < share < high:
            share = 0.5 * (low + high)
        excess = _excess(old, new, private, flow, terms, i, share)
        if excess == 0.0 or high - low <= RESOLUTION:
            break
        if excess < 0.0:
            above *= 0.5 if kept == 1 else 1.0
            low, below, kept = share, excess, 1
        else:
            below *= 0.5 if kept == -1 else 1.0
            high, above, kept = share, excess, -1
    return share


@kernel
def _excess(old, new, private, flow, terms, i, share):
    """Write new lambda_i at a share; return by how much the way to go exceeds the pull of rho."""
    z, lam, new_lam, a, C, d = old.z, old.lam, new.lam, private.a, private.C, private.d
    n, step, cap = len(z), flow.step, flow.multiplier_cap
    m_x, m_y = _reference(terms, share, n)
    distance = math.sqrt(n * ((m_x - terms.mean_x) ** 2 + (m_y - terms.mean_y) ** 2) + terms.square)
    rho, ahead_x, ahead_y, pull = (1.0 - share) * distance, 2.0 * m_x - z[i, 0], 2.0 * m_y - z[i, 1], 0.0
    for e in range(private.first[i], private.first[i + 1]):
        row = private.row[e]
        g = a[i, row] * rho + C[i, row, 0] * ahead_x + C[i, row, 1] * ahead_y - d[i, row]
        new_lam[i, row] = min(max(lam[i, row] + step * g, 0.0), cap)
        pull += a[i, row] * new_lam[i, row]
    return share * distance - step * flow.alpha * pull
