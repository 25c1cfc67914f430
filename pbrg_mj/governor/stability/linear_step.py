"""How large a round's step may be for the flow's linear modes: explicit Euler, from the problem's own data."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.network import Network

ZERO_MODE = 1e-9  # eigenvalues this small belong to what the flow conserves: the mean of zeta


def linear_step_limit(network: Network, alpha: float, gradients: np.ndarray) -> float:
    """Return the largest step [s] for which these linear modes of eqs. 25-30 decay under explicit Euler.

    An eigenvalue mu of the flow decays when |1 + step mu| < 1, that is step < -2 Re(mu) / |mu|^2. Computed are

    - m: consensus and the leaders' cost,
    - (z_pj, z_xij): consensus, pinned by robot j's nu,
    - m with the rows of one robot, whose gradient is at most `gradients` (n,) long (`max_gradient_norms`).

    It is no bound of the whole flow: rows of several robots at once, and the curvature of rho, are not in it. Of a row
    a rho + C m - d the curvature pulls m with a stiffness of up to kappa = alpha n a lambda / rho, which grows beyond
    all limits as a team comes to rest on a line with lambda > 0, so that no step bounds it before the run. What happens
    then is bounded all the same: the pull is never longer than a lambda sqrt(n), and m chatters within a step's length
    of it. docs/theory.md has how often a round at this limit is unstable, measured over random problems, and how far
    the step must shrink for it not to be.
    """
    pinned = _consensus(network)
    kinds = _one_of_each_kind(network, gradients)
    flows = [_with_multiplier(pinned, robot, alpha, 1.0) for robot in kinds]
    return min(_euler_limit(flow) for flow in [*flows, *row_flows(network, alpha, gradients)])


def row_flows(network: Network, alpha: float, gradients: np.ndarray) -> list[np.ndarray]:
    """Return the linear flows of m: consensus with the leaders' cost, alone and with the rows of one robot each."""
    n, consensus = network.robots, _consensus(network)
    consensus[:n, :n] -= 2.0 * alpha * np.diag(network.leader)
    kinds = _one_of_each_kind(network, gradients)
    return [consensus, *(_with_multiplier(consensus, robot, alpha, gradients[robot]) for robot in kinds)]


def max_gradient_norms(network: Network, formation: np.ndarray, inputs: Rows | None, growth: float = 1.0) -> np.ndarray:
    """Return for every robot how long the gradient in m of all its rows of one half-space can be, (n,).

    Of a ball row it is at most 1 + gamma sqrt(n), since ||grad_m rho|| <= sqrt(n), gamma being the weight of rho
    (`growth`), and as many rows of one half-space bind at
    once as robots of the formation, b (n, 2) [m], stand in one line at its edge. Of an input row it is at most
    a sqrt(n); `inputs` is None without input constraints.
    """
    n = network.robots
    squares = np.full(n, max_robots_on_hull_edge(formation) * (1.0 + growth * np.sqrt(n)) ** 2)
    if inputs is not None:
        squares += n * np.sum(inputs.a**2, axis=1)
    return np.sqrt(squares)


def max_robots_on_hull_edge(formation: np.ndarray) -> int:
    """Return the largest number of robots that one half-space can meet at once: on one edge of b's convex hull."""
    corners = _convex_hull(formation)
    most = 1
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = end - start
        beside = (formation - start) @ (along[1], -along[0])
        most = max(most, int(np.sum(np.abs(beside) <= 1e-9 * max(float(np.abs(along).max()), 1.0))))
    return most


def _convex_hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    ascending = np.unique(points, axis=0).tolist()

    def half(along: list[list[float]]) -> list[list[float]]:
        chain: list[list[float]] = []
        for x, y in along:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                chain.pop()
            chain.append([x, y])
        return chain[:-1] if len(chain) > 1 else chain

    return np.array(half(ascending) + (half(ascending[::-1]) if len(ascending) > 1 else []))


def _one_of_each_kind(network: Network, gradients: np.ndarray) -> list[int]:
    """Return one robot of each degree and kind: the pinned flow depends on little else, and n of them cost n^4."""
    kinds = np.column_stack([network.degree, network.leader, gradients])
    return np.unique(kinds, axis=0, return_index=True)[1].tolist()


def _consensus(network: Network) -> np.ndarray:
    L = network.laplacian
    return np.block([[-L, L], [-L, np.zeros_like(L)]])


def _with_multiplier(flow: np.ndarray, robot: int, alpha: float, gradient: float) -> np.ndarray:
    """Return the flow with one multiplier of robot's constraint, whose gradient has the given length."""
    size = len(flow)
    coupled = np.zeros((size + 1, size + 1))
    coupled[:size, :size] = flow
    coupled[robot, size] = -alpha * gradient
    coupled[size, robot] = gradient
    return coupled


def _euler_limit(flow: np.ndarray) -> float:
    modes = np.linalg.eigvals(flow)
    modes = modes[np.abs(modes) > ZERO_MODE]
    return float(np.min(-2.0 * modes.real / np.abs(modes) ** 2)) if len(modes) else np.inf
