"""One cycle of all robots at once, where every message arrives within its round: what `robot` does, bit for bit.

Its arrays grow with the robots and their links, so that a team may have ten thousand.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.rollout.messages import (
    HALF_SPACE,
    HEADER,
    NORMAL,
    STATE,
    SUMMARY,
    VERDICT,
    HalfSpace,
    Key,
    Verdict,
)
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.prediction import write_change
from pbrg_mj.governor.rollout.verdicts import HalfSpaceArrays, Rollout, Summary

UNIT = np.array([1.0, 0.0])  # m of the rollout from rest at 0 that gives the step response


class Cycle(NamedTuple):
    """What a cycle finds out."""

    summary: Summary
    response: np.ndarray  # s (T + 1, n)
    verdicts: Mapping[Key, Verdict] | None  # agreed by all; None in the cycle that finds the step response
    bytes_sent: np.ndarray  # (exchanges, n)


def run_cycle(
    plan: RolloutPlan,
    graph: tuple[np.ndarray, np.ndarray, np.ndarray],
    state: tuple[np.ndarray, np.ndarray],
    held: np.ndarray,
    bounds: Mapping[Key, HalfSpace],
    response: np.ndarray | None,
) -> Cycle:
    """Return what comes of a cycle that begins at p, xi (n, 2) [m] with m (2,) [m] held, NaN before the first decision.

    `graph` is first, neighbours, leader of `GraphArrays`; `response` None: it is found.
    """
    p, xi = state
    n, degree = len(p), np.diff(graph[0])
    numbers = np.concatenate([p.min(axis=0), p.max(axis=0), [np.hypot(xi[:, 0], xi[:, 1]).max()], held])
    summary, m, half_spaces = Summary.of(numbers), np.zeros((n, 2)), HalfSpaceArrays.of(bounds)
    x = np.zeros((n, 4)) if response is None else np.hstack([p, xi])
    m[graph[2] > 0.0] = UNIT if response is None else held
    rollout, found, nothing = Rollout(plan, np.arange(n), x, half_spaces, summary), [np.zeros((1, n))], np.zeros((n, 2))
    for _ in range(plan.steps):
        for i in range(plan.order):
            write_change(graph, rollout.v[i], nothing if i else m, plan.gains, rollout.v[i + 1])
        rollout.finish_step(response)
        if response is None:
            found.append(rollout.states[:, :, 0].copy())
    if response is not None:
        rollout.finish()
    flood_bytes = np.tile(degree * (HEADER.size + SUMMARY.size), (plan.diameter, 1))
    low, high, verdict_bytes = _agreed(plan.diameter, graph, half_spaces, rollout.low, rollout.high)
    verdicts = {
        key: Verdict(bounds[key].Gx, bounds[key].Gy, float(down), float(up))
        for key, down, up in zip(sorted(bounds), low, high, strict=True)
        if np.isfinite(down) or np.isfinite(up)
    }
    return Cycle(
        summary=summary,
        response=np.concatenate(found) if response is None else response,
        verdicts=None if response is None else verdicts,
        bytes_sent=np.concatenate([flood_bytes, _rollout_bytes(plan, graph, half_spaces), verdict_bytes]),
    )


def _rollout_bytes(plan: RolloutPlan, graph: tuple[np.ndarray, ...], half_spaces: HalfSpaceArrays) -> np.ndarray:
    """Return the bytes (K p, n) of the rollout's exchanges, in which half-spaces go to all robots in order of keys."""
    first, neighbours, _ = graph
    degree = np.diff(first)
    sent = np.tile(degree * (HEADER.size + STATE.size), (plan.steps * plan.order, 1))
    known = (half_spaces.owner[:, None] == np.arange(len(degree))) & half_spaces.binds_all[:, None]
    forwarded = np.zeros_like(known)
    for i, row in enumerate(sent):
        fresh = known & ~forwarded
        if not fresh.any():
            break
        if not plan.sends_all_left(plan.diameter + i):
            fresh &= np.cumsum(fresh, axis=0) == 1  # the first alone
        row += degree * HALF_SPACE.size * fresh.sum(axis=0)
        forwarded |= fresh
        known |= np.logical_or.reduceat(fresh[:, neighbours], first[:-1], axis=1)
    return sent


def _agreed(
    diameter: int, graph: tuple[np.ndarray, ...], half_spaces: HalfSpaceArrays, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what all robots allow, low and high (W,), and the bytes (D, n) by which they agree."""
    first, neighbours, _ = graph
    degree, sent = np.diff(first), np.zeros((diameter, len(first) - 1), dtype=np.int64)
    sizes = np.where(half_spaces.binds_all, VERDICT.size, VERDICT.size + NORMAL.size)
    sent_low, sent_high = np.full_like(low, -np.inf), np.full_like(high, np.inf)
    for exchange in range(diameter):
        fresh = (low != sent_low) | (high != sent_high)
        sent[exchange] = degree * (HEADER.size + sizes @ fresh)
        sent_low, sent_high = low, high
        low = np.maximum(low, np.maximum.reduceat(low[:, neighbours], first[:-1], axis=1))
        high = np.minimum(high, np.minimum.reduceat(high[:, neighbours], first[:-1], axis=1))
    return low.max(axis=1, initial=-np.inf), high.min(axis=1, initial=np.inf), sent
