"""The pre-stabiliser of eq. 2, sampled once a tick, is stable on the scenario's graph.

Sampled every h seconds, a mode mu of the continuous team decays when |1 + h mu| < 1, that is h < -2 Re(mu) / |mu|^2.
Without a leak, and with M = L + alpha_r Delta, this holds for all modes when

    h lambda_max(L) < 1    and    h lambda_max(M) < 2

(docs/theory.md), so that most scenarios need no eigenvalues: lambda_max(L) is at most the largest sum of the degrees of
two neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema import Control, Edge, Scenario, edge_list

MOST_ROBOTS = 300  # whose modes are computed; of more, the two conditions decide
ZERO_MODE = 1e-9  # [1/s] of what the team conserves: the sum of xi


def sampled_pre_stabiliser(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield a tick at which the team runs away from any reference. Expects a graph and leaders that are right."""
    control, tick, n = scenario.control, scenario.timing.tick, scenario.robots
    edges = edge_list(scenario.graph, n)
    degree = np.bincount(np.array(edges, dtype=np.int64).reshape(-1), minlength=n)
    steepest = max((int(degree[i] + degree[k]) for i, k in edges), default=0)
    if control.leak == 0.0 and tick * steepest < 1.0 and tick * (steepest + control.alpha_r) < 2.0:
        return
    leaders = [number - 1 for number in scenario.team.leaders]
    longest = _longest_tick(edges, degree, leaders, control)
    if tick >= longest:
        yield Diagnostic(
            ("timing", "tick"),
            f"is {tick:g} s, at which the pre-stabiliser (eq. 2) is unstable with this graph and "
            f"control.alpha_r = {control.alpha_r:g}; allowed: less than {longest:.4g} s",
        )


def _longest_tick(edges: Sequence[Edge], degree: np.ndarray, leaders: Sequence[int], control: Control) -> float:
    n = len(degree)
    if n > MOST_ROBOTS:
        return _sufficient_tick(edges, degree, leaders, control)
    L = np.diag(degree.astype(float))
    for i, k in edges:
        L[i, k] = L[k, i] = -1.0
    M = L.copy()
    M[leaders, leaders] += control.alpha_r
    modes = np.linalg.eigvals(np.block([[-M, L], [-L, -control.leak * L]]))
    modes = modes[np.abs(modes) > ZERO_MODE]
    return float(np.min(-2.0 * modes.real / np.abs(modes) ** 2, initial=math.inf))


def _sufficient_tick(edges: Sequence[Edge], degree: np.ndarray, leaders: Sequence[int], control: Control) -> float:
    """Return the tick up to which the two conditions hold; a leak kappa beyond 3 tightens the first.

    Without leaders, and with an eigenvalue l of L, mu^2 + (1 + kappa) l mu + (1 + kappa) l^2 = 0.
    """
    from scipy.sparse import coo_array, diags_array  # of large teams alone; take a while to import
    from scipy.sparse.linalg import eigsh

    n, kappa = len(degree), control.leak
    i, k = np.array(edges, dtype=np.int64).T
    adjacency = coo_array((np.ones(len(edges)), (i, k)), shape=(n, n)).tocsr()
    L = diags_array(degree.astype(float)) - adjacency - adjacency.T
    lead = np.zeros(n)
    lead[leaders] = control.alpha_r
    start = np.random.default_rng(0).normal(size=n)
    largest, led = (float(eigsh(X, k=1, which="LA", v0=start)[0][0]) for X in (L, L + diags_array(lead)))
    overdamped = 0.25 * (1.0 + kappa + math.sqrt(max(0.0, (1.0 + kappa) * (kappa - 3.0))))
    return min(1.0 / (max(1.0, overdamped) * largest), 2.0 / led)
