"""How large the step of proximal rounds may be: a bound, from the graph and the number of rows alone."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.team.network import Network


def proximal_step_bound(network: Network, alpha: float, rows: float) -> float:
    """Return the step [s] below which proximal rounds converge from any estimates, whatever the state and the rows.

    With h the step it is the least of h lambda_max(L) = 2/3 and h^2 alpha kappa = 3/4, kappa = max(1, rows). `rows`
    is the largest eigenvalue of sum C'C over one robot's rows, at most their number since they are unit vectors. Proved
    in docs/theory.md for a problem that is held and has a solution, with messages that arrive within their round.
    """
    stiffest = float(np.linalg.eigvalsh(network.laplacian)[-1])
    of_rows = math.sqrt(0.75 / (alpha * max(1.0, rows)))
    return min(2.0 / (3.0 * stiffest), of_rows) if stiffest > 0.0 else of_rows
