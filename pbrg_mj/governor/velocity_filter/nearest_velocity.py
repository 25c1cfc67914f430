"""The velocity of one robot nearest to what is wanted that meets its rows and that its wheels can do."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.governor.certificate.projection import nearest_allowed
from pbrg_mj.governor.velocity_filter.turning import is_admissible_while_turning
from pbrg_mj.kernel import kernel

BISECTIONS = 12  # of the share of a retreat, and of what is wanted besides


@kernel
def can_retreat(needed):
    """Tell whether some velocity meets all rows, as `velocity_of_share` takes them, with all of their retreats."""
    normals, offsets, retreats = needed
    return nearest_allowed(0.0, 0.0, normals, offsets - retreats, 0.0)[0]


@kernel
def velocity_while_pushed_back(wanted, needed, body, spare, robots):
    """Return (x, y) [m/s] and the turn [rad], with the largest share of what is wanted that turning allows.

    It must exceed no row by more than `spare` [m/s], and lose no more of a retreat. If with nothing wanted it turns
    towards what it retreats from, as where two retreats leave only a way along both, their share falls until it does
    not. Rows of the first `robots`, which are of other robots, do not count. `needed` and `body` as for
    `velocity_of_share`: normals (R, 2), offsets (R,), retreats (R,).
    """
    normals, offsets, retreats = needed
    kept = normals[robots:], offsets[robots:], retreats[robots:]
    share = _largest_share(True, wanted, needed, body, spare, kept)
    x, y, theta = velocity_of_share(share, wanted, needed, body)
    comes = np.where(kept[2] > 0.0, kept[1], np.inf)
    kept = kept[0], comes, np.zeros(len(comes))
    if share > 0.0 or is_admissible_while_turning(x, y, theta, spare, kept):
        return x, y, theta
    share = _largest_share(False, wanted, needed, body, spare, kept)
    return _velocity_with(False, share, wanted, needed, body)


@kernel
def _largest_share(of_wanted, wanted, needed, body, spare, kept):
    """Return the largest share, at most 1, whose velocity `is_admissible_while_turning` by the rows `kept`.

    It is one of what is wanted, or with nothing wanted of the retreats.
    """
    x, y, theta = _velocity_with(of_wanted, 1.0, wanted, needed, body)
    if is_admissible_while_turning(x, y, theta, spare, kept):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        share = 0.5 * (low + high)
        x, y, theta = _velocity_with(of_wanted, share, wanted, needed, body)
        if is_admissible_while_turning(x, y, theta, spare, kept):
            low = share
        else:
            high = share
    return low


@kernel
def _velocity_with(of_wanted, share, wanted, needed, body):
    """Return what `velocity_of_share` does of a share of what is wanted, or of the retreats with nothing wanted."""
    if of_wanted:
        return velocity_of_share(share, wanted, needed, body)
    normals, offsets, retreats = needed
    return velocity_of_share(0.0, wanted, (normals, offsets, share * retreats), body)


@kernel
def velocity_of_share(share, wanted, needed, body):
    """Return (x, y) [m/s], nearest to a share of what is wanted (2,), and by what it turns the robot [rad].

    `needed` are the rows' normals (R, 2), offsets (R,) and retreats (R,) [m/s]; `body` its heading [rad], facets (F, 2)
    [s/m] and turning [rad s/m].
    """
    (normals, offsets, retreats), (heading, facets, turning) = needed, body
    found, x, y = _nearest_velocity(share * wanted[0], share * wanted[1], normals, offsets, retreats)
    scale = scale_for_wheels(x, y, heading, facets) if found else 0.0  # but for rounding, 0 is allowed
    x, y = scale * x, scale * y
    return x, y, turning * (math.cos(heading) * y - math.sin(heading) * x)


@kernel
def _nearest_velocity(x, y, normals, offsets, retreats):
    """Return (found, x, y): the nearest velocity whose rows are met, with the largest share of the required retreats.

    Without any retreat 0 meets all rows.
    """
    required = offsets - retreats
    found, best_x, best_y = nearest_allowed(x, y, normals, required, 0.0)
    if found or not retreats.any():
        return found, best_x, best_y
    found, best_x, best_y = nearest_allowed(x, y, normals, offsets, 0.0)
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        share = 0.5 * (low + high)
        required = offsets - share * retreats
        met, met_x, met_y = nearest_allowed(x, y, normals, required, 0.0)
        if met:
            low, found, best_x, best_y = share, True, met_x, met_y
        else:
            high = share
    return found, best_x, best_y


@kernel
def scale_for_wheels(x, y, heading, facets):
    """Return the largest share, at most 1, of a velocity [m/s] that the wheels can do; facets (F, 2) [s/m]."""
    c, s, largest = math.cos(heading), math.sin(heading), 1.0
    for f in range(len(facets)):
        largest = max(largest, facets[f, 0] * (c * x + s * y) + facets[f, 1] * (c * y - s * x))
    return 1.0 / largest
