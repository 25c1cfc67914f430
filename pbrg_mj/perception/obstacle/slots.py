"""Half-spaces of one robot in its slots."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.obstacle.half_space import half_space
from pbrg_mj.perception.obstacle.outline import confirm_corners, face_chains


@kernel
def update_half_spaces(tracks, robots, params, g, h, active):
    """Write the half-spaces g (K, 2), h (K,), active (K,) of the tracks (M,) into slots, about the anchor.

    An obstacle keeps its slot. New ones take free slots, nearest first, or displace the farthest.
    """
    confirm_corners(tracks, params)
    links = face_chains(tracks, params)
    root = _roots(tracks, links)
    rows, distance = np.zeros((len(tracks), 3)), np.full(len(tracks), math.inf)
    for i in range(len(tracks)):
        if root[i]:
            rows[i, 0], rows[i, 1], rows[i, 2], distance[i] = half_space(tracks, i, links, robots, params)
    _assign_slots(tracks, root, distance, len(h), params.slot_hysteresis)
    for slot in range(len(h)):
        g[slot, 0] = g[slot, 1] = h[slot] = 0.0
        active[slot] = False
    for i in range(len(tracks)):
        slot = tracks[i]["slot"]
        if root[i] and slot >= 0:
            g[slot, 0], g[slot, 1], h[slot] = rows[i, 0], rows[i, 1], rows[i, 2]
            active[slot] = True


@kernel
def _roots(tracks, links):
    """Return (M,) bool: the first face of each obstacle, which holds the obstacle's slot for all its faces."""
    before, after = links
    root = np.zeros(len(tracks), np.bool_)
    done = np.zeros(len(tracks), np.bool_)
    for ring in range(2):  # open chains first; what is left are closed ones, and any face may be their first
        for i in range(len(tracks)):
            walls = tracks[i]["live"] and tracks[i]["confirmed"]
            if not walls:
                tracks[i]["slot"] = -1
            elif not done[i] and (before[i] < 0 or ring):
                root[i] = True
                _inherit_slot(tracks, i, after, done)
    return root


@kernel
def _inherit_slot(tracks, root, after, done):
    """Give the obstacle's first face the slot that its longest known face holds.

    done (M,) bool are the faces that have been looked at.
    """
    slot, since, face = -1, math.inf, root
    while face >= 0 and not done[face]:
        done[face] = True
        if tracks[face]["slot"] >= 0 and tracks[face]["first"] < since:
            slot, since = tracks[face]["slot"], tracks[face]["first"]
        tracks[face]["slot"] = -1
        face = after[face]
    tracks[root]["slot"] = slot


@kernel
def _assign_slots(tracks, root, distance, slots, hysteresis):
    """Give slots to obstacles without one, nearest first; by `hysteresis` [m] nearer, that of another."""
    while True:
        new, nearest = -1, math.inf
        for i in range(len(tracks)):
            if root[i] and tracks[i]["slot"] < 0 and distance[i] < nearest:
                new, nearest = i, distance[i]
        if new < 0:
            return
        slot = _free_slot(tracks, root, distance, slots, nearest + hysteresis)
        if slot < 0:
            return
        tracks[new]["slot"] = slot


@kernel
def _free_slot(tracks, root, distance, slots, most):
    """Return a free slot, or that of the farthest obstacle if it is farther than `most` [m], or -1."""
    used = np.zeros(slots, np.bool_)
    farthest = -1
    for i in range(len(tracks)):
        if root[i] and tracks[i]["slot"] >= 0:
            used[tracks[i]["slot"]] = True
            if distance[i] > most:
                farthest, most = i, distance[i]
    for slot in range(slots):
        if not used[slot]:
            return slot
    if farthest < 0:
        return -1
    slot = tracks[farthest]["slot"]
    tracks[farthest]["slot"] = -1
    return slot
