"""The references r_i of many ticks at once, and what of the cost follows from them alone.

Each is what the property of `Problem` of its name gives, to the bit, and the problems keep it as if it had been
asked for there. Tick by tick, calls of NumPy on five robots' numbers take four times as long.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.near_reference import near_references


def cache_near_references(problems: Sequence[Problem], p: np.ndarray) -> np.ndarray:
    """Cache r_i of T ticks in the problems and return it, (T, n, 2) [m]; p (T, n, 2) are those of the problems."""
    reference, reach = problems[0].reference, problems[0].reference_range
    if any(one.reference is not reference or one.reference_range != reach for one in problems):
        near = np.array([one.near_references for one in problems])
    else:
        near = near_references(p.reshape(-1, 2), reference, reach).reshape(p.shape)
    for problem, own in zip(problems, near, strict=True):
        vars(problem)["near_references"] = own
    return near


def cache_reference_costs(problems: Sequence[Problem]) -> None:
    """Cache `mean_reference` and `least_cost` of T ticks of one run in the problems."""
    network = problems[0].network
    near = np.concatenate([one.near_references for one in problems]).reshape(-1, network.robots, 2)
    mean = np.matmul(network.leader, near) / network.leaders
    square = np.sum((near - mean[:, None]) ** 2, axis=2)
    # A row of robots at a time: as one matrix the sums would be taken in another order.
    least = np.matmul(square[:, None], network.leader)[:, 0]
    for problem, (x, y), cost in zip(problems, mean.tolist(), least.tolist(), strict=True):
        vars(problem).update(mean_reference=(x, y), least_cost=cost)
