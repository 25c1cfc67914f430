"""The PI-consensus pre-stabiliser of eq. 2."""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.network import Network


def pre_stabiliser_rates(
    network: Network, control: Control, p: np.ndarray, xi: np.ndarray, m: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocities u and the rates dxi/dt, both (n, 2) [m/s], in plain NumPy: the specification.

    u_j = -sum_k L_jk (p_k - xi_k) + alpha_r delta_j (m_j - p_j),  dxi_j/dt = -sum_k L_jk (p_k + leak xi_k)

    so that robot j needs the p and xi of its neighbours only. All arguments are (n, 2) [m]; m_j is the governed
    reference as robot j knows it. (Eq. 5 of the paper gives the same u, but for alpha_r; its eq. 6 has the wrong sign.)

    The leak is ours, 0 in the paper. It bounds xi when robots cannot follow (stuck or saturated wheels), and takes
    nothing away: it keeps the sum of xi since 1'L = 0, it adds -leak xi'L xi <= 0 to dV/dt so that the certificate
    stays valid, and it vanishes where L xi = 0, as in the formation at m with u = 0.
    """
    L, delta = network.laplacian, network.leader[:, None]
    u = -L @ (p - xi) + control.alpha_r * delta * (m - p)  # eq. 2
    return u, -L @ (p + control.leak * xi)


def pre_stabilise(
    network: Network, control: Control, p: np.ndarray, xi: np.ndarray, m: np.ndarray, backend: str = "compiled"
) -> tuple[np.ndarray, np.ndarray]:
    """Return what `pre_stabiliser_rates` does, compiled unless the backend is `numpy`."""
    if backend == "numpy":
        return pre_stabiliser_rates(network, control, p, xi, m)
    u, rate = np.empty(p.shape), np.empty(p.shape)
    write_pre_stabilised(network.arrays, (p, xi, m), control.alpha_r, control.leak, u, rate)
    return u, rate


@kernel
def write_pre_stabilised(graph, state, alpha_r, leak, u, rate):
    """Write u and rate (n, 2), the velocities and dxi/dt of eq. 2 [m/s].

    `graph` is first, neighbours, leader of `GraphArrays`, `state` p, xi, m, each (n, 2) [m].
    """
    first, neighbours, leader = graph
    p, xi, m = state
    for j in range(len(p)):
        for axis in range(2):
            apart = turned = 0.0  # sum_k L_jk p_k and sum_k L_jk xi_k
            for e in range(first[j], first[j + 1]):
                k = neighbours[e]
                apart += p[j, axis] - p[k, axis]
                turned += xi[j, axis] - xi[k, axis]
            u[j, axis] = turned - apart + alpha_r * leader[j] * (m[j, axis] - p[j, axis])
            rate[j, axis] = -(apart + leak * turned)
