"""What sensing costs: the centralized optimum on sensed half-spaces against the one on the true walls."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pbrg_mj.analysis.metrics.best_formation import HalfSpaceRows, best_formation
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.within_range import WithinRange
from pbrg_mj.governor.certificate.by_name import CERTIFICATES
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Certificate, Problem, StateCertificate
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network


class TrueOptimum:
    """The centralized optimum with the true walls in place of the sensed half-spaces.

    The walls count by the faces that the best admissible formation for a tick's r stands behind.
    """

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._rows_of: dict[bytes, HalfSpaceRows | None] = {}

    def solve(self, p: np.ndarray, xi: np.ndarray, reference: np.ndarray, m: np.ndarray) -> np.ndarray | None:
        """Return m* (S, 2) [m] at states p, xi (S, n, 2) [m] and r (S, 2) [m]; certificate and rest as in the run.

        Certificates of the state are taken about m (S, 2) [m], the mean of what the leaders apply.

        NaN where the true problem has no solution. None where `scope: own` or the obstacles leave no such formation,
        and where motors are predicted, whose state is more than p and xi.
        """
        if self._scenario.estimator.scope == "own" or self._scenario.governor.predicted_motion != "kinematic":
            return None
        found = np.full((len(reference), 2), np.nan)
        for k, r in enumerate(reference):
            true = self._rows(r)
            if true is None:
                return None
            spaces, certificate = _in_slots_of_the_first_robot(true), self._certificate
            if isinstance(certificate, StateCertificate):
                rows = certificate.rows_at(spaces, p[k], xi[k], m[k])
            else:
                rows = certificate.rows(spaces)
            reach = self._scenario.governor.reference_range
            found[k] = self._solver.solve(Problem(self._graph, p[k], xi[k], rows, r, reference_range=reach)).m
        return found

    @cached_property
    def _graph(self) -> Network:
        return network(self._scenario)

    @cached_property
    def _certificate(self) -> Certificate | StateCertificate:
        """The scenario's certificate; the ball in place of another package's, which may not be installed."""
        of = CERTIFICATES.get(self._scenario.governor.certificate, BallCertificate.of)
        return of(self._scenario, self._graph)

    @cached_property
    def _solver(self) -> WithinRange:
        return WithinRange(ClarabelSolver())

    def _rows(self, r: np.ndarray) -> HalfSpaceRows | None:
        if r.tobytes() not in self._rows_of:
            best = best_formation(self._scenario, r)
            self._rows_of[r.tobytes()] = None if best.point is None else best.rows
        return self._rows_of[r.tobytes()]


def _in_slots_of_the_first_robot(rows: HalfSpaceRows) -> HalfSpaces:
    """Return half-spaces in slots of the first robot: whose they are makes no difference to a centralized solver."""
    robots, count = rows.binds.shape[1], len(rows.h)
    spaces = HalfSpaces.empty(robots, max(count, 1))
    spaces.G[0, :count], spaces.h[0, :count] = rows.G, rows.h
    spaces.active[0, :count], spaces.binds[0, :count] = True, rows.binds
    return spaces
