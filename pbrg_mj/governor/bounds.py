"""Whether the estimates are still such that anybody should act on them."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel


@kernel
def judged(z, lam, limit, cap):  # pragma: no cover - compiled
    """Return whether estimates z and lambda are finite and z within `limit`, and whether some lambda is at `cap`."""
    bounded, capped = True, False
    for value in z.flat:
        bounded &= math.isfinite(value) and abs(value) <= limit
    for value in lam.flat:
        bounded &= math.isfinite(value)
        capped |= value >= cap
    return bounded, capped
