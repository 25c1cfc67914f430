"""From predictions to verdicts on m, and to the leaders' decision. The same code for one robot and for all."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.projection import least_violating, near_allowed, nearest_allowed, search_radius
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.near_reference import near_point
from pbrg_mj.governor.rollout.messages import HalfSpace, Key, Verdict
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.prediction import narrow_by_terminal_bounds, narrow_intervals, write_states


class HalfSpaceArrays(NamedTuple):
    """Half-spaces as arrays."""

    owner: np.ndarray  # (W,) int64
    binds_all: np.ndarray  # (W,) bool: binds all robots
    G: np.ndarray  # (W, 2)
    h: np.ndarray  # (W,) [m]

    @classmethod
    def of(cls, half_spaces: Mapping[Key, HalfSpace]) -> HalfSpaceArrays:
        """Return them in the order of their keys."""
        keys = sorted(half_spaces)
        found = [half_spaces[key] for key in keys]
        return cls(
            owner=np.array([owner for owner, _ in keys], dtype=np.int64),
            binds_all=np.array([one.binds_all for one in found], dtype=bool),
            G=np.array([(one.Gx, one.Gy) for one in found]).reshape(-1, 2),
            h=np.array([one.h for one in found], dtype=float),
        )


class Summary(NamedTuple):
    """What a flood collects of the team's state."""

    least: np.ndarray  # (2,) of all p [m]
    largest: np.ndarray  # (2,) [m]
    xi: float  # largest ||xi_j|| [m]
    held: np.ndarray  # (2,) m [m]; NaN before the first decision

    @classmethod
    def of(cls, numbers: np.ndarray) -> Summary:
        """Return the summary of its numbers (7,) as messages have them."""
        return cls(numbers[0:2], numbers[2:4], float(numbers[4]), numbers[5:7])

    @property
    def centre(self) -> np.ndarray:
        """Centre of the box that holds all p, (2,) [m]."""
        return 0.5 * (self.least + self.largest)

    def norm(self, G: np.ndarray) -> np.ndarray:
        """Return ||e|| along directions G (W, 2), (W,) [m]: no |G.(p_j - m)| or |G.xi_j| is larger."""
        reach = np.abs((self.centre - self.held) @ G.T) + 0.5 * (self.largest - self.least) @ np.abs(G).T
        return np.maximum(reach, self.xi)


def merged(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the numbers (7,) of two summaries in one; a held m that is known stands for one that is not."""
    least, largest = np.minimum(one[0:2], other[0:2]), np.maximum(one[2:4], other[2:4])
    held = other[5:7] if np.isnan(one[5]) else one[5:7]
    return np.concatenate([least, largest, [max(one[4], other[4])], held])


class Rollout:
    """Predictions of robots, step by step, and what they allow. `robots` (n,) are their numbers; changed in place."""

    def __init__(
        self, plan: RolloutPlan, robots: np.ndarray, x: np.ndarray, half_spaces: HalfSpaceArrays, summary: Summary
    ):
        """Begin at the states x (n, 4)."""
        n, count = len(robots), len(half_spaces.h)
        self.plan, self.half_spaces, self.summary = plan, half_spaces, summary
        self.team = robots, np.ascontiguousarray(plan.formation[robots]), plan.margin
        self.error = np.ascontiguousarray(plan.error[:, robots])
        self.norm = summary.norm(half_spaces.G)
        self.v, self.states = np.zeros((plan.order + 1, n, 4)), np.empty((len(plan.weights), n, 4))
        self.v[0], self.tick = x, 0
        self.low, self.high = np.full((count, n), -np.inf), np.full((count, n), np.inf)

    def finish_step(self, response: np.ndarray | None) -> None:
        """Take in the ticks of the step whose v is known; `response` s (T + 1, n), None while it is being found."""
        plan = self.plan
        write_states(plan.weights, self.v, self.states)
        if response is not None and len(self.half_spaces.h):
            rows = plan.hold, response, self.error, self.norm
            narrow_intervals(
                self.states, self.tick + 1, tuple(self.half_spaces), self.team, rows, (self.low, self.high)
            )
        self.tick += len(plan.weights)
        self.v[0] = self.states[-1]

    def finish(self) -> None:
        """Take in what comes after the last tick."""
        robots, plan = self.team[0], self.plan
        if len(self.half_spaces.h):
            bounds = np.ascontiguousarray(plan.from_start[robots]), np.ascontiguousarray(plan.from_hold[robots])
            held = self.summary.held
            narrow_by_terminal_bounds(
                held, tuple(self.half_spaces), self.team, (*bounds, self.norm), (self.low, self.high)
            )


def advance(
    aim: np.ndarray, verdicts: Mapping[Key, Verdict], team: np.ndarray, reach: float, farthest: float = math.inf
) -> tuple[np.ndarray, Status]:
    """Return the advance of m nearest to `aim` (2,) [m] that all verdicts allow, and its status.

    An aim farther than `farthest` [m] from the team is taken as the point so far on the way to it.
    Where there is none, or none near the `team` (2,) [m], which is where it is as seen from m (within `reach` [m], and
    what `search_radius` says), it is the one nearest to the team of those that violate the worst verdict least.
    """
    both = [
        side
        for key in sorted(verdicts)
        for Gx, Gy, low, high in [verdicts[key]]
        for side in ((Gx, Gy, high), (-Gx, -Gy, -low))
        if np.isfinite(side[2])
    ]
    rows = np.array(both).reshape(-1, 3)
    normals, offsets = np.ascontiguousarray(rows[:, :2]), np.ascontiguousarray(rows[:, 2])
    near_x, near_y = near_point(team[0], team[1], aim[0], aim[1], farthest)
    found, x, y = nearest_allowed(near_x, near_y, normals, offsets, 0.0)
    beyond = offsets - normals @ team
    if found and near_allowed(normals, offsets, beyond, reach):
        return np.array([x, y]), "ok"
    m = team + np.array(least_violating(normals, beyond, search_radius(beyond, reach)))
    return m, "inadmissible" if found else "infeasible"
