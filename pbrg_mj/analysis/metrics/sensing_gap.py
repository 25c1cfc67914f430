"""What sensing costs: the centralized optimum on sensed half-spaces against the one on the true walls."""

from __future__ import annotations

import numpy as np

from pbrg_mj.analysis.metrics.best_formation import HalfSpaceRows, best_formation
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.log.read.run import Run
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network


def true_optima(run: Run, among: np.ndarray) -> np.ndarray | None:
    """Return m* (rows, 2) [m] with the true walls in place of the sensed half-spaces.

    A row for each reference tick in `among`, (S,) bool. States, references and certificate are those of the run;
    NaN where the true problem has no solution. The walls count by the faces that the best admissible formation for that
    tick's r stands behind. None where `scope: own` or the obstacles leave no such formation.
    """
    scenario, ticks = run.scenario, run.ticks
    if scenario.estimator.scope == "own":
        return None
    graph = network(scenario)
    certificate, solver = BallCertificate.of(scenario, graph), ClarabelSolver()
    rows_of: dict[bytes, HalfSpaceRows | None] = {}
    found = np.full((np.count_nonzero(among), 2), np.nan)
    for row, tick in enumerate(np.searchsorted(ticks.index, run.optima.index[among])):
        r = ticks.reference[tick]
        if r.tobytes() not in rows_of:
            best = best_formation(scenario, r)
            rows_of[r.tobytes()] = None if best.point is None else best.rows
        true = rows_of[r.tobytes()]
        if true is None:
            return None
        rows = certificate.rows(_in_slots_of_the_first_robot(true))
        reach = scenario.governor.reference_range
        found[row] = solver.solve(Problem(graph, ticks.p[tick], ticks.xi[tick], rows, r, reference_range=reach)).m
    return found


def _in_slots_of_the_first_robot(rows: HalfSpaceRows) -> HalfSpaces:
    """Return half-spaces in slots of the first robot: whose they are makes no difference to a centralized solver."""
    robots, count = rows.binds.shape[1], len(rows.h)
    spaces = HalfSpaces.empty(robots, max(count, 1))
    spaces.G[0, :count], spaces.h[0, :count] = rows.G, rows.h
    spaces.active[0, :count], spaces.binds[0, :count] = True, rows.binds
    return spaces
