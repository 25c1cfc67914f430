"""How large a cap of the multipliers keeps the penalty exact, from the problem's own data.

Take one half-space and the ball rho^2 = n ||w||^2 + s^2, w = m - mean p, D the way left to the line at w = 0. The row
can be met where its relative slack e = 1 - (s / D) sqrt((n - 1) / n) is >= 0. On its border the gradient in m is
shortest opposite to the line, and with X = sqrt(n e (2 - e))

    ||grad g|| >= (n - 1) X / (n + X)

At the optimum m* it balances the leaders' pull 2 l ||r - m*||, so that the multipliers of the row's robots add up to at
most 2 l ||r - m*|| (n + X) / ((n - 1) X). docs/theory.md has the proof, and what holds of several half-spaces.
"""

from __future__ import annotations

import math

LEAST_SLACK = 0.05  # e from which on the cap is never in the way of one half-space


def exact_multiplier_cap(robots: int, leaders: float, reference_range: float) -> float:
    """Return mu [m]: no optimal multiplier of one half-space is larger while e >= 5 % and ||r - m*|| <= the range [m].

    Of one robot alone no mu is enough for all places of m*; it takes that of two.
    """
    n = max(robots, 2)
    X = math.sqrt(n * LEAST_SLACK * (2.0 - LEAST_SLACK))
    return 2.0 * leaders * reference_range * (n + X) / ((n - 1) * X)
