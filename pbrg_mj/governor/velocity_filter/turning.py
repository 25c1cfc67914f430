"""How much slower a robot goes past another one, or past what stands, because it turns while motors and camera lag.

What was asked for at one heading is driven at another. With the hand point l ahead of the body, a velocity w turns the
robot at omega = w_y / l, w_y its part across the heading, and behind a lag tau the hand point moves at R(theta) w with
theta = tau omega. So of w the largest share s is driven that meets the rows of separation.py all the way there:

    n.(R(a) s w) <= bound    for a from 0 to s theta.

The left side grows with s where it is positive, so that the largest share is found by bisection. The certificate does
not cover the turn: what it predicts are points that move at u and have no heading. So turns count for all robots,
displaced or not, and for half-spaces as for robots.

A robot that must turn to go past something would stand if every share had to. A quarter turn at the speed v costs at
most pi / 2 tau v of the distance: where that is no more than what robots have to spare, nothing is scaled.

A retreat is not scaled down because of rows that others share in. What a robot wants besides is, to the largest share
of it with which the turn leads towards nothing and takes nothing from the retreat, but for the speed at which turns
cost what robots have to spare. Where the retreat alone turns a robot towards what it retreats from, as between two
half-spaces that nearly face each other, whose rows leave only a way along both, the largest share of it is driven with
which it does not.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

BISECTIONS = 12  # of the share
ROUNDING = 1e-9  # [m/s] velocities that slide along a row exceed it by as much


@kernel
def turning_share(x, y, theta, min_speed, normals, offsets):
    """Return the largest share, at most 1, of the velocity (x, y) [m/s] that meets the rows while it turns.

    `theta` [rad] is by what the whole velocity turns the robot while it lags; `normals` (k, 2) and `offsets` (k,) [m/s]
    are n and the bound. A share at `min_speed` [m/s] or below need not meet them.
    """
    speed, largest = math.sqrt(x * x + y * y), 1.0
    if theta == 0.0 or speed <= min_speed:
        return largest
    for k in range(len(offsets)):
        towards = normals[k, 0] * x + normals[k, 1] * y
        beside = normals[k, 1] * x - normals[k, 0] * y
        if _approach(largest, theta, towards, beside) <= offsets[k] + ROUNDING:
            continue
        low, high = min_speed / speed, largest
        for _ in range(BISECTIONS):
            share = 0.5 * (low + high)
            if _approach(share, theta, towards, beside) <= offsets[k] + ROUNDING:
                low = share
            else:
                high = share
        largest = low
    return largest


@kernel
def is_admissible_while_turning(x, y, theta, spare, rows):
    """Tell whether a velocity (x, y) [m/s] exceeds no row by more than `spare` [m/s] while it turns by theta [rad].

    `rows` are normals (R, 2), offsets (R,) and retreats (R,) [m/s]. Of a retreat only as much counts as the velocity
    has of it when it has turned.
    """
    normals, offsets, retreats = rows
    for k in range(len(offsets)):
        towards = normals[k, 0] * x + normals[k, 1] * y
        beside = normals[k, 1] * x - normals[k, 0] * y
        bound = max(offsets[k] - retreats[k], min(towards, offsets[k]))
        if _approach(1.0, theta, towards, beside) > bound + spare:
            return False
    return True


@kernel
def _approach(share, theta, towards, beside):
    """Return the largest n.R(a) share w for a from 0 to share theta; n.w is `towards`, n.R(pi/2) w `beside`."""
    turn = abs(share * theta)
    side = beside if theta > 0.0 else -beside
    until = math.atan2(side, towards)  # w points along n
    if until < 0.0:
        until += 2.0 * math.pi
    if until <= turn:
        return share * math.sqrt(towards * towards + side * side)
    return share * max(towards, math.cos(turn) * towards + math.sin(turn) * side)
