"""By how much an applied reference violates each certificate, from states and half-spaces alone, tick by tick.

With m held from now on, y = G.m, x_G = (G.p - y 1, G.xi), the worst over all half-spaces and robots j that they bind of

    ball              rho   + y + G.b_j - h      (eq. 13)
    directional_ball  ||x_G|| + y + G.b_j - h
    predictive        max_t E_j(t) x_G + y + G.b_j - h, t = 0, the ticks of the prediction grid, and infinity

(behind motors the prediction's x_G is that of `problem.motion`)
without margins and factors: above 0, the certificate does not hold. Each is at most the one before it, the last two
where no ||E_j(t)|| is above 1. At ticks between those of the grid the prediction may be worse by their bound.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid, write_error
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario

NAMES: tuple[str, ...] = ("ball", "directional_ball", "predictive")
VIOLATED = 1e-6  # [m] a row above this does not hold; what is less is rounding
MOST_ROBOTS = 100  # of whom the prediction is evaluated: seconds of preparation, and they grow with the cube


def predicted_rows(scenario: Scenario) -> np.ndarray:
    """Return E_j(t) at the grid's ticks, (n, K, N); K is 0 for more than 100 robots, and teams that do not settle."""
    n = scenario.robots
    return rows_of_model(TeamModel.of_scenario(scenario)) if n <= MOST_ROBOTS else np.empty((n, 0, 2 * n))


@lru_cache(maxsize=2)
def rows_of_model(model: TeamModel) -> np.ndarray:
    """Return the same for any number of robots."""
    n, size = model.rate.shape
    try:
        return PredictionGrid.of(model).E.reshape(n, -1, size)
    except ValueError:
        return np.empty((n, 0, size))


def worst_rows(
    half_spaces: HalfSpaces,
    states: tuple[np.ndarray, np.ndarray, np.ndarray],
    formation: np.ndarray,
    E: np.ndarray,
    motion: np.ndarray | None = None,
) -> np.ndarray:
    """Return the worst value of the three certificates at T ticks, (T, 3) [m], in the order of `NAMES`.

    The arrays of `half_spaces` have T as their first axis; `states` are p and xi (T, n, 2) and what l leaders apply,
    m (T, l, 2), of which the worst counts; `formation` is b (n, 2), `E` that of `predicted_rows`, `motion`
    (T, n, 1 + d, 2) [m] what its robots keep behind motors. -inf where nothing is bound; the prediction NaN without E.
    """
    p, xi, m = states
    worst = np.full((len(m), 3), -np.inf)
    spaces, reach = _contiguous((half_spaces.G, half_spaces.h, half_spaces.binds)), _reach(E)
    start = _contiguous(prediction_state(p, xi, motion))
    for leader in range(m.shape[1]):
        _update_worst(spaces, _contiguous((p, xi, m[:, leader])), start, formation, E, reach, worst)
    if not E.shape[1]:
        worst[:, 2] = np.nan
    return worst


def _contiguous(arrays: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    return tuple(map(np.ascontiguousarray, arrays))


def _reach(E: np.ndarray) -> float:
    """Return the largest ||E_j(t)||, by which ||x_G|| bounds what is predicted; 1 but for long ticks."""
    return math.sqrt(float(np.einsum("jkc,jkc->jk", E, E).max(initial=1.0)))


@kernel
def _update_worst(half_spaces, states, start, formation, E, reach, worst):
    """Raise `worst` (T, 3) [m] to what is worst with m (T, 2) applied; `reach` is the largest ||E_j(t)||.

    `half_spaces` are G (T, n, K, 2), h (T, n, K), binds (T, n, K, n); `states` p, xi (T, n, 2), m; `start`
    the prediction's: places (T, n, 2) and others (T, N - n, 2), p and xi if N = 2n; formation (n, 2); E (n, Q, N) at
    the grid's Q ticks.
    """
    G, h, binds = half_spaces
    p, xi, m = states
    places, others = start
    n, motors = len(formation), others.shape[1] > len(formation)
    error, moved, known = np.empty((2 * n, 2)), np.empty((n, E.shape[1], 2)), np.empty(n, dtype=np.bool_)
    ahead = np.empty((n + others.shape[1], 2)) if motors else error
    for t in range(len(m)):
        rho = write_error(p[t], xi[t], m[t], error)
        if motors:
            write_error(places[t], others[t], m[t], ahead)
        known[:] = False
        ball = directional = predicted = -np.inf
        for i in range(h.shape[1]):
            for k in range(h.shape[2]):
                G_x, G_y, rest = G[t, i, k, 0], G[t, i, k, 1], -np.inf
                at_m = G_x * m[t, 0] + G_y * m[t, 1] - h[t, i, k]
                for j in range(n):
                    if binds[t, i, k, j]:
                        rest = max(rest, at_m + G_x * formation[j, 0] + G_y * formation[j, 1])
                if rest == -np.inf:
                    continue
                size = _size_along(error, G_x, G_y)
                ball, directional, predicted = (
                    max(ball, rest + rho),
                    max(directional, rest + size),
                    max(predicted, rest),
                )
                if motors:
                    size = _size_along(ahead, G_x, G_y)
                for j in range(n):
                    at = at_m + G_x * formation[j, 0] + G_y * formation[j, 1]
                    if not binds[t, i, k, j] or at + reach * size <= predicted:
                        continue  # no tick can be worse
                    if not known[j]:
                        _write_moved(E, ahead, j, moved)
                        known[j] = True
                    for r in range(E.shape[1]):
                        predicted = max(predicted, at + G_x * moved[j, r, 0] + G_y * moved[j, r, 1])
        worst[t, 0], worst[t, 1] = max(worst[t, 0], ball), max(worst[t, 1], directional)
        worst[t, 2] = max(worst[t, 2], predicted)


@kernel
def _size_along(error, G_x, G_y):
    """Return ||x_G||."""
    square = 0.0
    for row in range(len(error)):
        square += (G_x * error[row, 0] + G_y * error[row, 1]) ** 2
    return math.sqrt(square)


@kernel
def _write_moved(E, error, j, moved):
    """Write E_j(t) times both coordinates of the error (N, 2) to row j of `moved` (n, Q, 2); E (n, Q, N)."""
    for r in range(E.shape[1]):
        x = y = 0.0
        for c in range(len(error)):
            x += E[j, r, c] * error[c, 0]
            y += E[j, r, c] * error[c, 1]
        moved[j, r, 0], moved[j, r, 1] = x, y
