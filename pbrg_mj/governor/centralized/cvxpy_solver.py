"""The centralized reference as one reads it: CVXPY, solved by Clarabel. The oracle for the direct form."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import cvxpy as cp
import numpy as np
from cvxpy.error import SolverError

from pbrg_mj.governor.centralized.clarabel_solver import TOLERANCES
from pbrg_mj.governor.centralized.optimum import Optimum, OptimumStatus
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import rho_along


@dataclass(frozen=True)
class _Program:
    """One compiled convex program with its parameters."""

    problem: cp.Problem
    m: cp.Variable
    rows: cp.Constraint | None
    parameters: dict[str, cp.Parameter]


class CvxpySolver:
    """The problem of eqs. 10-13 in four dimensions; one compiled program per number of rows.

    A solver belongs to one run, so that nothing Clarabel keeps between solves can leak into another run's bits.
    """

    def __init__(self) -> None:
        self._programs: dict[tuple[int, int, bool], _Program] = {}

    def solve(self, problem: Problem) -> Optimum:
        """Solve `problem`; infeasible and failed are statuses, not exceptions."""
        started = perf_counter()
        rows, leaders = problem.rows, int(problem.network.leader.sum())
        owner, row = np.nonzero(rows.active)
        directional = len(rows.along) > 0
        key = (len(owner), leaders, directional)
        if key not in self._programs:
            compiled = _directional_program if directional else _program
            self._programs[key] = compiled(problem.network.robots, *key[:2])
        program = self._programs[key]
        centre = problem.p.mean(axis=0)
        values = {
            "r": np.array(problem.mean_reference),
            "centre": centre,
            "s": float(np.sqrt(np.sum((problem.p - centre) ** 2) + np.sum(problem.xi**2))),
            "a": rows.a[owner, row],
            "C": rows.C[owner, row],
            "d": rows.d[owner, row],
        }
        if directional:
            G = rows.along[owner, row]
            values["aG"], values["aG_centre"] = values["a"][:, None] * G, values["a"] * (G @ centre)
            values["a_s"] = values["a"] * rho_along(G, centre, problem.p, problem.xi)
        for name, parameter in program.parameters.items():
            parameter.value = values[name]
        words, solving = _solve(program.problem)
        found = _STATUS.get(words, "failed")
        multipliers = np.full(rows.d.shape, np.nan)
        if found == "solved":
            multipliers[:] = 0.0
            if program.rows is not None:
                dual: Any = program.rows.dual_value
                multipliers[owner, row] = dual[0] if directional else dual
        m = np.array(program.m.value) if found == "solved" else np.full(2, np.nan)
        return Optimum(
            m=m,
            status=found,
            cost=problem.cost(m) if found == "solved" else np.nan,
            multipliers=multipliers,
            solver_status=words,
            build_seconds=perf_counter() - started - solving,
            solve_seconds=solving,
        )


_STATUS: dict[str, OptimumStatus] = {
    cp.OPTIMAL: "solved",
    cp.OPTIMAL_INACCURATE: "solved",  # to the reduced tolerances
    cp.INFEASIBLE: "infeasible",
    cp.INFEASIBLE_INACCURATE: "infeasible",
}


def _solve(program: cp.Problem) -> tuple[str, float]:
    """Return the status in CVXPY's words and Clarabel's own solve time [s]."""
    try:
        with warnings.catch_warnings():  # an inaccurate solution is a status here, not a warning
            warnings.simplefilter("ignore", UserWarning)
            program.solve(solver=cp.CLARABEL, **TOLERANCES)
    except SolverError as error:
        return f"solver error: {error}".splitlines()[0], 0.0
    return str(program.status), float(program.solver_stats.solve_time or 0.0)


def _program(n: int, count: int, leaders: int) -> _Program:
    """Compile min leaders ||r - m||^2 subject to t >= rho(m, p, xi) and a t + C m <= d in `count` rows.

    r is the mean of the leaders' r_i.

    All rows share rho, and rho^2 = n ||m - mean p||^2 + s^2 with s^2 = sum ||p_j - mean p||^2 + ||xi||^2, so that one
    cone of dimension 4 serves n robots; so Clarabel reaches these tolerances, with cones of dimension 4n often not.
    """
    m, t, r = cp.Variable(2), cp.Variable(), cp.Parameter(2)
    cost = cp.Minimize(leaders * cp.sum_squares(m - r))
    if not count:
        return _Program(cp.Problem(cost), m, None, {"r": r})
    centre, s = cp.Parameter(2), cp.Parameter(nonneg=True)
    a, C, d = cp.Parameter(count, nonneg=True), cp.Parameter((count, 2)), cp.Parameter(count)
    cone = cp.SOC(t, cp.hstack([np.sqrt(n) * (m - centre), s]))
    rows = a * t + C @ m <= d  # eq. 13
    parameters = {"r": r, "centre": centre, "s": s, "a": a, "C": C, "d": d}
    return _Program(cp.Problem(cost, [cone, rows]), m, rows, parameters)


def _directional_program(n: int, count: int, leaders: int) -> _Program:
    """Compile the same for rows with directions: a ||x_G|| <= d - C m, each a cone of dimension 3.

    ||x_G||^2 = n (G.m - G.mean p)^2 + s_G^2 with s_G = ||x_G|| at mean p.
    """
    m, r = cp.Variable(2), cp.Parameter(2)
    cost = cp.Minimize(leaders * cp.sum_squares(m - r))
    if not count:
        return _Program(cp.Problem(cost), m, None, {"r": r})
    aG, aG_centre, a_s = cp.Parameter((count, 2)), cp.Parameter(count), cp.Parameter(count, nonneg=True)
    C, d = cp.Parameter((count, 2)), cp.Parameter(count)
    rows = cp.SOC(d - C @ m, cp.vstack([np.sqrt(n) * (aG @ m - aG_centre), a_s]), axis=0)
    parameters = {"r": r, "aG": aG, "aG_centre": aG_centre, "a_s": a_s, "C": C, "d": d}
    return _Program(cp.Problem(cost, [rows]), m, rows, parameters)
