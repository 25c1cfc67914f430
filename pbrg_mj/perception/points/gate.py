"""The gate of a track: which flows may be of what moves as it does."""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face_track import predicted_covariance

GATE = 9.0  # squared innovation beyond which a flow is not this face's: where a line joins two faces


@kernel
def count_flows_in_gate(track, beside, time):
    """Return how many flows are in a track's gate: may be of what moves as it does."""
    (flows, chosen), gate, count = beside, _gate(track, time), 0
    for i in chosen:
        count += not _is_outside(flows, i, gate)
    return count


@kernel
def flows_outside_gate(track, beside, time):
    """Return which of the flows chosen are outside a track's gate: not of what moves as it does.

    `beside` are the flows and those chosen of them, (size,).
    """
    (flows, chosen), gate, size = beside, _gate(track, time), 0
    others = np.empty(len(chosen), np.int64)
    for i in chosen:
        others[size] = i
        size += _is_outside(flows, i, gate)
    return others[:size]


@kernel
def _gate(track, time):
    """Return a track's velocity (2,) [m/s] and its covariance at a time, xx, xy and yy [m^2/s^2]."""
    return (track["vx"], track["vy"]), predicted_covariance(track, time)


@kernel
def _is_outside(flows, i, gate):
    """Tell whether flow i is outside a gate (velocity, covariance) as `_gate` returns it."""
    ((vx, vy), (cxx, cxy, cyy)), fx, fy = gate, flows.nx[i], flows.ny[i]
    error = flows.speed[i] - fx * vx - fy * vy
    own = cxx * fx * fx + 2.0 * cxy * fx * fy + cyy * fy * fy
    return error * error > GATE * (own + flows.variance[i] + flows.shared[i])
