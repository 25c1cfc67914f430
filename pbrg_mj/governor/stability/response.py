"""How fast a team follows its governed reference m, against how fast the paper's flow finds m."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.stability.linear_step import row_flows
from pbrg_mj.team.network import Network

ZERO_MODE = 1e-9  # eigenvalues this small belong to what the flow conserves: the mean of zeta


def response_ratio(network: Network, alpha_r: float, alpha: float, gradients: np.ndarray) -> float:
    """Return l lambda_min(L + alpha_r Delta) over the rate of the slowest linear mode of the flow, a number.

    The team follows a constant m at the rate lambda_min(L + alpha_r Delta) [1/s] of eq. 2. The flow answers at that of
    consensus, the l leaders' cost and one robot's rows, whose gradient is at most `gradients` (n,) long
    (`max_gradient_norms`), in flow seconds. The multipliers have to grow to l times what one leader's pull takes, at
    the same speed. Nothing is proved of the ratio: docs/theory.md has how often teams crossed a line above 2, and
    below.
    """
    team = float(np.linalg.eigvalsh(network.laplacian + alpha_r * np.diag(network.leader))[0])
    modes = np.concatenate([np.linalg.eigvals(flow) for flow in row_flows(network, alpha, gradients)])
    flow = float(np.min(-modes.real[np.abs(modes) > ZERO_MODE]))
    return network.leaders * team / flow if flow > 0.0 else np.inf
