"""The network of a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pbrg_mj.scenario.schema import Scenario, edge_list
from pbrg_mj.team.network import Network


def network(scenario: Scenario) -> Network:
    """Return the scenario's communication graph and leaders."""
    n = scenario.robots
    leader = np.zeros(n)
    leader[[number - 1 for number in scenario.team.leaders]] = 1.0
    return network_of_edges(edge_list(scenario.graph, n), leader)


def network_of_edges(edges: Sequence[tuple[int, int]], leader: np.ndarray) -> Network:
    """Return the network of undirected `edges`, pairs of robots counted from 0; `leader` is delta, (n,)."""
    n = len(leader)
    adjacency = np.zeros((n, n))
    for i, k in edges:
        adjacency[i, k] = adjacency[k, i] = 1.0
    degree = adjacency.sum(axis=1)
    first = np.concatenate([[0], np.cumsum(degree)]).astype(np.int64)
    return Network(np.diag(degree) - adjacency, first, np.nonzero(adjacency)[1].astype(np.int64), leader)
