"""Which predicted positions are looked at, and what may happen between them.

Position j of one coordinate is, t ticks ahead under constant m, p_j(t) = y + E_j(t) e with e = x - (y 1, 0) and
E_j(t) = e_j' A^t. Between grid points a < b it stays below the line that joins them, plus

    (b - a)^2 / 8 max_{a <= t <= b - 2} ||E_j(t) (A - I)^2|| ||e||,

since (A - I)^2 A^t e are its second differences. After the last point T it stays below y + gamma_j ||A^T|| ||e|| with
gamma_j = sup_t ||E_j(t)||. So finitely many rows bound every position for ever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel

BETWEEN = 2e-4  # largest bound between two grid points, per metre of ||e||


@dataclass(frozen=True)
class PredictionGrid:
    """R rows: y + E e + bound ||e|| is what a robot's coordinate is, or stays below, at or about a grid point."""

    robot: np.ndarray  # (R,) int64
    tick: np.ndarray  # (R,) int64; the tail's rows stand at the last tick
    E: np.ndarray  # (R, 2n); zeros in the tail's rows
    s: np.ndarray  # (R,) step response 1 - E (1, 0); ones in the tail's rows
    bound: np.ndarray  # (R,)
    horizon: int  # T, ticks

    @classmethod
    def of(cls, model: TeamModel, between: float = BETWEEN) -> PredictionGrid:
        """Return the grid of a team whose bounds between points are at most `between`.

        Raises ValueError when the sampled team does not settle.
        """
        horizon = model.settling_ticks()
        ticks, bounds = _spacing(model, horizon, between)
        n = model.robots
        E = np.stack([model.after(t)[:n] for t in ticks])  # (K, n, 2n)
        tail = largest_response(model, horizon) * np.linalg.norm(model.after(horizon), 2)
        return cls(
            robot=np.concatenate([np.tile(np.arange(n), len(ticks)), np.arange(n)]),
            tick=np.concatenate([np.repeat(ticks, n), np.full(n, horizon)]),
            E=np.vstack([E.reshape(-1, 2 * n), np.zeros((n, 2 * n))]),
            s=np.concatenate([1.0 - (E @ model.at_rest).ravel(), np.ones(n)]),
            bound=np.concatenate([bounds.ravel(), tail]),
            horizon=horizon,
        )


def _spacing(model: TeamModel, horizon: int, between: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the grid's ticks (K,) and the bound beside each of them for every robot, (K, n)."""
    n = model.robots
    second = (model.step - np.eye(2 * n)) @ (model.step - np.eye(2 * n))
    E = model.after(0)[:n]
    last, ticks, gaps = 0, [0], []
    largest, bound = np.zeros(n), np.zeros(n)  # over the gap that is open
    for tick in range(1, horizon + 1):
        # Closing the gap at `tick` leaves the points last + 1 .. tick - 1 between; E is that of tick - 2.
        if tick - last >= 2:
            largest = np.maximum(largest, np.linalg.norm(E @ second, axis=1))
            E = E @ model.moving_part
            wider = (tick - last) ** 2 / 8.0 * largest
            if wider.max() > between:
                ticks.append(tick - 1)
                gaps.append(bound)
                last, largest, bound = tick - 1, np.zeros(n), np.zeros(n)
            else:
                bound = wider
    ticks.append(horizon)
    gaps.append(bound)
    none = np.zeros((1, n))
    beside = np.maximum(np.vstack([none, gaps]), np.vstack([gaps, none]))
    return np.array(ticks), beside


def largest_response(model: TeamModel, horizon: int) -> np.ndarray:
    """Return gamma_j = sup over all t of ||E_j(t)||, (n,): the largest up to T, since ||A^T|| <= 1 bounds the rest."""
    E = model.after(0)[: model.robots]
    largest = np.linalg.norm(E, axis=1)
    for _ in range(horizon):
        E = E @ model.moving_part
        largest = np.maximum(largest, np.linalg.norm(E, axis=1))
    return largest
