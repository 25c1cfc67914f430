"""Which predicted positions are looked at, and what may happen between them.

Position j of one coordinate is, t ticks ahead under constant m, p_j(t) = y + E_j(t) e with e = x - (y 1, 0) in R^N and
E_j(t) = e_j' A^t, e_j' being the row that gives p_j (`TeamModel.position`); N = 2n but behind motors.
Between grid points a < b it stays below the line that joins them, plus

    (b - a)^2 / 8  Gamma ||E_j(a) (A - I)^2||  ||e||,    Gamma = sup_t ||A^t||,

since its second differences are E_j(a) (A - I)^2 A^(t - a) e. After the last point T it stays below
y + ||e_j|| Gamma ||A^T|| ||e||, ||e_j|| being 1, behind motors sqrt(2). So finitely many rows bound every position for
ever.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.kernel import kernel

GRID_TOLERANCE = 1e-3  # largest bound between two grid points, per metre of ||e||


@dataclass(frozen=True)
class PredictionGrid:
    """n K rows, robot by robot: y + E e + bound ||e|| is what a robot's coordinate is, or stays below, about a tick.

    The last row of every robot is its tail: E is zero there, and it stands for all ticks after the last one.
    """

    tick: np.ndarray  # (K,) int64; the tail's is the last tick once more
    E: np.ndarray  # (n * K, N)
    s: np.ndarray  # (n, K) step response 1 - E (1, 0)
    bound: np.ndarray  # (n, K)

    @classmethod
    def of(cls, model: TeamModel, between: float = GRID_TOLERANCE) -> PredictionGrid:
        """Return the grid of a team whose bounds between points are at most `between`.

        Equal teams share one grid. Raises ValueError when the sampled team does not settle.
        """
        return _grid(model, between)

    @cached_property
    def columns(self) -> np.ndarray:
        """E once more, (n, N, K): what kernels go through from row to row lies side by side."""
        n, points = self.s.shape
        return np.ascontiguousarray(self.E.reshape(n, points, -1).transpose(0, 2, 1))

    @property
    def horizon(self) -> int:
        """The last tick T that is looked at."""
        return int(self.tick[-1])


@lru_cache(maxsize=2)
def _grid(model: TeamModel, between: float) -> PredictionGrid:
    horizon, (n, size) = model.settling_ticks(), model.rate.shape
    ticks, bounds, positions = _spacing(model, horizon, between)
    E = np.stack([*positions, np.zeros((n, size))], axis=1)  # (n, K, N)
    tail = model.growth * np.linalg.norm(model.after(horizon), 2) * np.linalg.norm(model.position, axis=1)[None]
    return PredictionGrid(
        tick=np.append(ticks, horizon),
        E=E.reshape(-1, size),
        s=1.0 - E @ model.at_rest,
        bound=np.ascontiguousarray(np.vstack([bounds, tail]).T),
    )


def _spacing(model: TeamModel, horizon: int, between: float) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return the grid's ticks (K,), the bound beside each of them for every robot (K, n), and E (n, N) at each."""
    n, size = model.rate.shape
    second = np.linalg.matrix_power(model.step - np.eye(size), 2)
    ticks, gaps, positions = [0], [], [model.after(0, model.position)]
    while ticks[-1] < horizon:
        curvature = model.growth * np.linalg.norm(positions[-1] @ second, axis=1)
        widest = math.isqrt(int(8.0 * between / max(curvature.max(), 8.0 * between / horizon**2)))
        width = min(max(widest, 1), horizon - ticks[-1])
        gaps.append(width**2 / 8.0 * curvature if width > 1 else np.zeros(n))
        ticks.append(ticks[-1] + width)
        positions.append(model.after(width, positions[-1]))
    none = np.zeros((1, n))
    return np.array(ticks), np.maximum(np.vstack([none, gaps]), np.vstack([gaps, none])), positions


@kernel
def write_error(p, xi, m, error):
    """Write (p - m, xi) of p (n, 2), xi (N - n, 2) and m (2,) to `error` (N, 2) [m]; return its norm, rho if N = 2n."""
    n, square = len(p), 0.0
    for j in range(n):
        for axis in range(2):
            error[j, axis], error[n + j, axis] = p[j, axis] - m[axis], xi[j, axis]
            square += error[j, axis] ** 2 + error[n + j, axis] ** 2
    for j in range(n, len(xi)):
        for axis in range(2):
            error[n + j, axis] = xi[j, axis]
            square += xi[j, axis] ** 2
    return math.sqrt(square)


@kernel
def write_times_error(columns, j, error, found):
    """Write the rows of robot j, of `columns` (n, N, K), times both coordinates of the error to `found` (2, K).

    Sums are taken in the order of columns, so that they are the same on every processor and for any number of rows.
    """
    for k in range(found.shape[1]):
        found[0, k] = found[1, k] = 0.0
    for c in range(len(error)):
        x, y = error[c, 0], error[c, 1]
        for k in range(found.shape[1]):
            found[0, k] += columns[j, c, k] * x
            found[1, k] += columns[j, c, k] * y
