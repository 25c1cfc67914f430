"""How late the messages of the plain exchange may be: roots of its linearised rounds, counted without computing any.

With messages d_e rounds late on link e, the modes z^k of the rounds (step s, growth per round z) see the Laplacian
L(z) = D - A(z), A_ik = z^(-d_ik). Eliminating zeta, a component of the estimates grows by z where the determinant of

    P(z) = (z - 1) I + s (L(z) + K) + s^2 L(z)^2 / (z - 1),    K = 2 alpha diag(delta) for m, 0 for z_p and z_xi

vanishes, and with a multiplier of robot i whose constraint has a gradient of length g, where

    det P(z) (1 + s^2 alpha g^2 [P(z)^-1]_ii / (z - 1)) = 0.

Divided by (z - 1)^n this is analytic outside the unit circle and 1 at infinity, so by the argument principle the
growing modes are as many as its turns about 0, clockwise, along a circle just outside. No matrix of the size of all
delays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.team.network import Network

NEGLIGIBLE_GROWTH = 1e-4  # growth [1/s] that no run is long enough to see
GRID_SPACING = 1.0  # [rad] of delayed messages and of log theta, over the robots: all factors may turn at once
MAX_TURN = 0.8  # [rad] largest turn of a determinant from point to point; larger ones are looked at more closely
MAX_ROBOTS = 20  # robots; the work grows with n^5
MAX_REFINEMENTS = 30  # times at most, by halves
RATE_MARGIN = 4.0  # least multiple of the flow's rates beyond which nothing turns about 0 any more


@dataclass(frozen=True)
class DelayedRounds:
    """Linearised rounds of the plain exchange on one network."""

    network: Network
    alpha: float
    step: float  # of a round [s]
    delay: np.ndarray  # (E,) int64 rounds, of every directed link

    def scaled(self, longest: int) -> DelayedRounds:
        """Return the same with delays in the same proportion, the longest being `longest`."""
        return DelayedRounds(self.network, self.alpha, self.step, self.delay * longest // max(1, int(self.delay.max())))


def delay_margin(rounds: DelayedRounds, gradients: np.ndarray) -> int | None:
    """Return how long the longest delay may be, in rounds, the others in proportion; None: as long as it is.

    Stable is: no mode of consensus and pinned states grows, nor any with the multipliers of one robot's constraints,
    whose gradients in m are `gradients` (n,) long (`max_gradient_norms`). -1 when not even no delay is stable.
    """
    if _stable(rounds, gradients):
        return None
    steady, growing = -1, int(rounds.delay.max(initial=0))
    while growing - steady > 1:
        middle = (steady + growing) // 2
        if _stable(rounds.scaled(middle), gradients):
            steady = middle
        else:
            growing = middle
    return steady


def _stable(rounds: DelayedRounds, gradients: np.ndarray) -> bool:
    theta = _angles(rounds, float(gradients.max()))
    values = determinants(rounds, gradients, theta)
    for _ in range(MAX_REFINEMENTS):
        turns = np.abs(np.angle(values[1:] * values[:-1].conj())) > MAX_TURN
        coarse = turns.any(axis=1)
        if not coarse.any():
            return not any(growing_modes(mode) for mode in values.T)
        between = 0.5 * (theta[1:] + theta[:-1])[coarse]
        theta = np.concatenate([theta, between])
        values = np.concatenate([values, determinants(rounds, gradients, between)])
        order = np.argsort(theta)
        theta, values = theta[order], values[order]
    return False  # a mode on the circle itself


def _angles(rounds: DelayedRounds, gradient: float) -> np.ndarray:
    """Return angles of the upper half of the circle, [rad], from 0 to pi or to where all is settled."""
    step, alpha = rounds.step, rounds.alpha
    rate = 2.0 * rounds.network.degree.max(initial=0) + 2.0 * alpha + np.sqrt(alpha) * gradient
    far = max(RATE_MARGIN, rounds.network.robots)  # each robot's factor of the determinant still turns by 1 / far there
    last = min(np.pi, far * step * rate)
    first = 0.01 * step * NEGLIGIBLE_GROWTH
    fine = GRID_SPACING / rounds.network.robots
    turns = np.exp(np.arange(np.log(first), np.log(last), fine))
    even = np.arange(first, last, fine / (1.0 + rounds.delay.max(initial=0)))
    return np.concatenate([[0.0], np.union1d(turns, even), [last]])


def determinants(rounds: DelayedRounds, gradients: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return the modes' determinants over (z - 1)^n, up to their size, (S, M): pinned, led, and led with rows."""
    points = (1.0 + rounds.step * NEGLIGIBLE_GROWTH) * np.exp(1j * theta)
    free, inverse = _response(rounds, points, 0.0)
    pinned = free[:, None] * (1.0 + _multiplier(rounds, points, np.ones(rounds.network.robots)) * inverse)
    led, inverse = _response(rounds, points, 2.0 * rounds.alpha)
    bound = led[:, None] * (1.0 + _multiplier(rounds, points, gradients) * inverse)
    return np.column_stack([pinned, led, bound])


def _response(rounds: DelayedRounds, points: np.ndarray, lead: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the phase of det P / (z - 1)^n (S,) and the diagonal of P^-1 (S, n); K = `lead` diag(delta)."""
    network, step = rounds.network, rounds.step
    n = network.robots
    seen = np.zeros((len(points), n, n), dtype=complex)
    seen[:, network.receiver, network.neighbours] = points[:, None] ** -rounds.delay.astype(float)
    late = np.diag(network.degree) - seen  # L(z)
    ahead = (points - 1.0)[:, None, None]
    scaled = np.eye(n) + step * (late + lead * np.diag(network.leader)) / ahead + (step / ahead) ** 2 * (late @ late)
    inverse = np.linalg.inv(scaled) / ahead
    return np.linalg.slogdet(scaled)[0], np.diagonal(inverse, axis1=1, axis2=2)


def _multiplier(rounds: DelayedRounds, points: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Return what multipliers with gradients (n,) of these lengths add to their robots' entries of P, (S, n)."""
    return rounds.step**2 * rounds.alpha * gradients**2 / (points - 1.0)[:, None]


def growing_modes(values: np.ndarray) -> int:
    """Return how often values (S,) turn about 0, clockwise, on the whole circle; they are those on its upper half.

    The first value is real. The last is, too, if the circle was followed to -1; if not, all is settled there, and the
    values go on to a positive number without another turn.
    """
    angle = np.unwrap(np.angle(values))
    return -round((angle[-1] - angle[0] - _final_angle(values[-1])) / np.pi)


def _final_angle(last: complex) -> float:
    return float(np.angle(last)) if last.real > 0.0 else 0.0
