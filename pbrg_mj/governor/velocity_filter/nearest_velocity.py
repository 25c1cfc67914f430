"""The velocity of one robot nearest to what is wanted that meets its rows and that its wheels can do."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.governor.certificate.projection import nearest_allowed
from pbrg_mj.governor.velocity_filter.turning import is_admissible_while_turning
from pbrg_mj.kernel import kernel

BISECTIONS = 12  # of the slack of rows, of the share of a retreat, and of what is wanted besides
ROUNDING = 1e-6  # [m/s] to spare, since what is left may be a point


@kernel
def is_feasible(normals, offsets):
    """Tell whether some velocity meets rows, normals (R, 2) and offsets (R,) [m/s]."""
    return nearest_allowed(0.0, 0.0, normals, offsets, 0.0)[0]


@kernel
def relax_rows(rows, comes):
    """Change offsets and retreats of rows that no velocity meets with all of their retreats, so that one does.

    `rows` are normals (R, 2), offsets (R,) and retreats (R,) [m/s]. Those of what `comes` (R,) and retreats are
    relaxed, all by the same slack, the least that will do, but retreats from what rests at most by themselves: nobody
    goes farther beyond it. Then, the largest retreat first, each is by as much less as the others leave.
    """
    normals, offsets, retreats = rows
    required = offsets - retreats
    most = np.where(comes, math.inf, retreats)
    slack = np.minimum(most, _least_slack(normals, required, most, retreats.max()))
    for k in np.argsort(-retreats, kind="mergesort"):  # the same order everywhere
        if slack[k] > 0.0:
            enough, slack[k] = slack[k], 0.0
            alone = np.where(np.arange(len(slack)) == k, enough, 0.0)
            slack[k] = _least_slack(normals, required + slack, alone, enough)
    required += np.where(slack > 0.0, np.minimum(most, slack + ROUNDING), 0.0)
    offsets[:] = np.maximum(offsets, required)
    retreats[:] = offsets - required


@kernel
def _least_slack(normals, offsets, most, enough):
    """Return the least slack of rows, of each at most `most` (R,), with which some velocity meets them [m/s].

    `enough` is known to do: the largest retreat does, with which 0 meets them.
    """
    if is_feasible(normals, offsets):
        return 0.0
    least = 0.0
    for _ in range(BISECTIONS):
        slack = 0.5 * (least + enough)
        if is_feasible(normals, offsets + np.minimum(most, slack)):
            enough = slack
        else:
            least = slack
    return enough


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
    bounds = np.where(kept[2] > 0.0, kept[1], np.inf)
    kept = kept[0], bounds, np.zeros(len(bounds))
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

    `needed` are the rows' normals (R, 2), offsets (R,) and retreats (R,) [m/s], which some velocity meets, but for
    rounding; `body` its heading [rad], facets (F, 2) [s/m] and turning [rad s/m].
    """
    (normals, offsets, retreats), (heading, facets, turning) = needed, body
    found, x, y = nearest_allowed(share * wanted[0], share * wanted[1], normals, offsets - retreats, 0.0)
    scale = scale_for_wheels(x, y, heading, facets) if found else 0.0
    x, y = scale * x, scale * y
    return x, y, turning * (math.cos(heading) * y - math.sin(heading) * x)


@kernel
def scale_for_wheels(x, y, heading, facets):
    """Return the largest share, at most 1, of a velocity [m/s] that the wheels can do; facets (F, 2) [s/m]."""
    c, s, largest = math.cos(heading), math.sin(heading), 1.0
    for f in range(len(facets)):
        largest = max(largest, facets[f, 0] * (c * x + s * y) + facets[f, 1] * (c * y - s * x))
    return 1.0 / largest
