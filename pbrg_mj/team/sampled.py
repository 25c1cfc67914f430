"""The pre-stabilised team as it is really driven: u held from tick to tick.

Under a constant m, x = (p - 1 (x) m, xi) of one axis moves by the matrix A of eq. 9, and sampled every h seconds by
x+ = B x, B = I + h A: exactly, in the ideal plant, since robots drive straight between ticks and xi is summed tick by
tick. In continuous time ||x|| = rho never grows; under B it may, for a while. What a certificate bounds are single rows
of x, a robot's place or its u, and those stay below what rho once was at all but the longest ticks.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.network import Network

MOST_ROBOTS = 300  # the work grows with n^3
MOST_DOUBLINGS = 40  # 2^40 ticks
MOST_DELAYED = 50  # robots whose delayed modes are counted; the work grows with n^3
GROWTH_THRESHOLD = 1e-5  # of a mode in a tick, from which on it counts as growing
POINTS = 40  # of half the circle, for each tick of delay
ROUNDING = 1e-12


def continuous_map(network: Network, control: Control) -> np.ndarray:
    """Return A of eq. 9, (2n, 2n) [1/s]: the rates of x = (p - 1 m, xi) of one axis. Its first n rows give u."""
    L = network.laplacian
    return np.block([[-L - control.alpha_r * np.diag(network.leader), L], [-L, -control.leak * L]])


def sampled_map(network: Network, control: Control, tick: float) -> np.ndarray:
    """Return B, (2n, 2n), on x = (p - 1 m, xi) of one axis; `tick` is h [s]."""
    return np.eye(2 * network.robots) + tick * continuous_map(network, control)


def zero_sum(robots: int) -> np.ndarray:
    """Return the projector (2n, 2n) onto all p and the xi with the sum 0, which xi starts from and keeps (1'L = 0)."""
    projector = np.eye(2 * robots)
    projector[robots:, robots:] -= 1.0 / robots
    return projector


def sampled_growth(network: Network, control: Control, tick: float) -> tuple[float, np.ndarray]:
    """Return sup_t max_j ||e_j' B^t|| of the robots' places, and sup_t ||A_j B^t|| / ||A_j|| of their u, (n,).

    Both at least 1, over t = 1, 2, ... and all xi with the sum 0 (`zero_sum`). inf where
    the sampled team is unstable, 1 for teams of more than 300 robots, of which they are not computed.
    """
    n = network.robots
    if n > MOST_ROBOTS:
        return 1.0, np.ones(n)
    B = sampled_map(network, control, tick)
    rows = np.vstack([np.eye(n, 2 * n), B[:n] - np.eye(n, 2 * n)])
    places, inputs = np.split(_row_growth(rows, B @ zero_sum(n)), 2)
    return float(places.max()), inputs


def _row_growth(rows: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return sup_t ||row B^t|| / ||row|| of every row, at least 1.

    With ||B^T|| <= 1 and t = k T + s, ||row B^t|| <= ||row B^s|| ||B^T||^k <= ||row B^s||: the first T powers hold the
    supremum. T is sought among the powers of 2, whose norms bound those of all powers: ||B^s|| <= M, their product over
    the digits of s. So t is the last tick to look at once M ||row B^t|| is no more than was seen, in every row.
    """
    ticks, power, most = 1, B, 1.0
    while (norm := np.linalg.norm(power, 2)) > 1.0 + ROUNDING:
        ticks, power, most = 2 * ticks, power @ power, most * norm
        if ticks > 2**MOST_DOUBLINGS or not np.isfinite(power).all():
            return np.full(len(rows), np.inf)
    length, largest = np.linalg.norm(rows, axis=1), np.ones(len(rows))
    for _ in range(ticks):
        rows = rows @ B
        growth = np.linalg.norm(rows, axis=1) / length
        largest = np.maximum(largest, growth)
        if np.all(most * growth <= largest):
            break
    return np.where(largest <= 1.0 + ROUNDING, 1.0, largest)


def delay_margin(network: Network, control: Control, tick: float, delay: int) -> int | None:
    """Return the longest delay in ticks, below `delay`, at which no mode of the team grows; None: `delay` is no longer.

    Robots take their own p and xi as they are, and their neighbours' d ticks late. -1 when no delay is stable. Raises
    ValueError for more than `MOST_DELAYED` robots, of which it is not computed.
    """
    if network.robots > MOST_DELAYED:
        raise ValueError("too many robots")
    if growing_modes(network, control, tick, delay) == 0:
        return None
    steady, growing = -1, delay
    while growing - steady > 1:
        middle = (steady + growing) // 2
        grows = growing_modes(network, control, tick, middle) > 0
        steady, growing = (steady, middle) if grows else (middle, growing)
    return steady


def growing_modes(network: Network, control: Control, tick: float, delay: int) -> int:
    """Return how many modes z^t of x = (p - 1 m, xi) of one axis grow, neighbours being heard `delay` ticks late.

    They are the zeros of det(z I - I - own - z^-d late) outside the unit circle, own and late being what of h A (eq. 9)
    acts on a robot's own states and on its neighbours'. Divided by z^2n it is 1 at infinity, so that by the argument
    principle they are its turns about 0, clockwise, along a circle just outside.
    """
    n, A = network.robots, tick * continuous_map(network, control)
    own = np.kron(np.ones((2, 2)), np.eye(n)) * A
    even = np.linspace(0.0, np.pi, POINTS * (delay + 10))
    theta = np.union1d(even, np.geomspace(0.01 * GROWTH_THRESHOLD, np.pi, POINTS * 20))
    z = ((1.0 + GROWTH_THRESHOLD) * np.exp(1j * theta))[:, None, None]
    sign = np.linalg.slogdet(np.eye(2 * n) - (np.eye(2 * n) + own + z ** -float(delay) * (A - own)) / z)[0]
    angle = np.unwrap(np.angle(sign))
    return -round(float(angle[-1] - angle[0]) / np.pi)
