"""How far a position that a rollout predicts may be from the true one of the ideal plant.

Row j of the tick map's power, E_j(t) = e_j' A^t, gives the true position, and the rollout's polynomials give rows close
to it. With e the error to the fixed point (m, 0), and ||e|| the largest of its 2n numbers along a direction,

    |predicted - true| <= ||E_j(t) - rolled out row||_1  ||e||,    |position - m| <= sup_(s >= t) ||E_j(s)||_1  ||e||.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel, UnsettledTeamError

MOST_DOUBLINGS = 24  # of ticks in which a stable team's rows have become shorter than 1


class RolloutBounds(NamedTuple):
    """Both norms for every robot."""

    error: np.ndarray  # (T + 1, n) of the prediction at ticks 0 .. T
    remaining: np.ndarray  # (T + 1, n) of the position at that tick and at all later ones


def rollout_bounds(model: TeamModel, weights: np.ndarray, steps: int) -> RolloutBounds:
    """Return the bounds of a rollout of so many steps with `weights` (Q, p + 1).

    Raises ValueError when the sampled team does not settle.
    """
    from scipy.sparse import csr_array  # takes a while to import

    n, (width, terms) = model.robots, weights.shape
    change, rolled = model.step - np.eye(2 * n), np.eye(2 * n)
    powers = [np.eye(2 * n)]
    for _ in range(terms - 1):
        powers.append(powers[-1] @ change)
    last = np.tensordot(weights[-1], np.array(powers), axes=1)
    back = csr_array(model.step.T)  # few of its numbers are not 0
    true, error, lengths = np.eye(n, 2 * n), [np.zeros(n)], [np.ones(n)]
    for _ in range(steps):
        parts = np.array([(power @ rolled)[:n] for power in powers])
        for r in range(width):
            true = (back @ true.T).T
            error.append(np.abs(np.tensordot(weights[r], parts, axes=1) - true).sum(axis=1))
            lengths.append(np.abs(true).sum(axis=1))
        rolled = last @ rolled
    for _ in range(_ticks_to_shorten(model)):
        true = (back @ true.T).T
        lengths.append(np.abs(true).sum(axis=1))
    remaining = np.maximum.accumulate(np.array(lengths)[::-1])[::-1]
    return RolloutBounds(np.array(error), np.ascontiguousarray(remaining[: len(error)]))


def _ticks_to_shorten(model: TeamModel) -> int:
    """Return ticks M after which no row is longer: ||e_j' A^(t + M)||_1 <= ||e_j' A^t||_1 max_i ||e_i' A^M||_1.

    So the longest of the M rows after the last one of interest is the longest of all that follow.
    """
    power, ticks = model.moving_part, 1
    for _ in range(MOST_DOUBLINGS):
        if np.abs(power).sum(axis=1).max() <= 1.0:
            return ticks
        power, ticks = power @ power, 2 * ticks
    raise UnsettledTeamError
