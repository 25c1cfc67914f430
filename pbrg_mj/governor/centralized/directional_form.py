"""The centralized problem where rows have directions: a cone of three dimensions for each group of rows.

||x_G||^2 = n (G.m - G.mean p)^2 + s^2 with s = ||x_G|| at mean p, so that a row is

    ||(a sqrt(n) G.(m - mean p), a s)|| <= d - C m

in the form A m + slack = b with the slack (d - C m, a sqrt(n) G.(m - mean p), a s) in a second-order cone. The first
component of its dual variable is the row's multiplier.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import rho_along


def cone_matrix(problem: Problem, tightest: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return A's values, column after column, for the rows `tightest` (robots, rows)."""
    steep = -math.sqrt(problem.network.robots) * problem.rows.a[tightest][:, None] * problem.rows.along[tightest]
    return np.stack([problem.rows.C[tightest], steep], axis=1).transpose(2, 0, 1).reshape(-1)


def cone_bounds(problem: Problem, tightest: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return b (3 rows,), which alone is new at every tick."""
    rows, centre = problem.rows, problem.p.mean(axis=0)
    a, G = rows.a[tightest], rows.along[tightest]
    steep, rest = -math.sqrt(problem.network.robots) * a * (G @ centre), rho_along(G, centre, problem.p, problem.xi)
    return np.column_stack([rows.d[tightest], steep, a * rest]).reshape(-1)


def cone_pattern(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return row indices and column starts of A: of every cone the first two rows, in both columns."""
    rows = (3 * np.arange(count)[:, None] + [0, 1]).reshape(-1)
    return np.tile(rows, 2), np.array([0, 2 * count, 4 * count])
