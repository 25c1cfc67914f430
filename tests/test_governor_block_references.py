"""What is worked out of many ticks at once is what each problem says of itself, to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.problem.block_references import cache_near_references, cache_reference_costs
from pbrg_mj.governor.problem.interface import Problem
from tests.problems import graph, problem


def problems_of(rng: np.random.Generator, n: int, reach: float, moving: bool) -> list[Problem]:
    path, r = [(i, i + 1) for i in range(n - 1)], rng.normal(size=2)
    network, found = graph(path, leaders=range(0, n, 2), n=n), []
    for _ in range(20):
        static = problem([], rng.normal(size=(n, 2)), r, network, formation=np.zeros((n, 2)))
        reference = rng.normal(size=2) if moving else r
        found.append(Problem(network, static.p, static.xi, static.rows, reference, reference_range=reach))
    return found


@pytest.mark.parametrize("n", [2, 5, 31])
@pytest.mark.parametrize("reach", [0.7, np.inf])
@pytest.mark.parametrize("moving", [False, True])
def test_blocks_keep_the_bits_of_each_problem(n: int, reach: float, moving: bool) -> None:
    together, alone = (problems_of(np.random.default_rng(61), n, reach, moving) for _ in range(2))
    near = cache_near_references(together, np.array([one.p for one in together]))
    cache_reference_costs(together)
    for block, one, own in zip(together, alone, near, strict=True):
        np.testing.assert_array_equal(own, one.near_references)
        np.testing.assert_array_equal(block.near_references, one.near_references)
        assert vars(block)["mean_reference"] == one.mean_reference
        assert vars(block)["least_cost"] == one.least_cost
