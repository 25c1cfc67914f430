"""What metrics say of a run against its centralized optimum, and of the wall clock, a block of the log at a time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.index_join import IndexJoin
from pbrg_mj.analysis.metrics.samples import Samples, WallClock
from pbrg_mj.analysis.metrics.sensing_gap import TrueOptimum
from pbrg_mj.governor.problem.near_reference import near_references
from pbrg_mj.log.read.column_store import Columns
from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.scenario.schema import Scenario

OF_TICKS = ("index", "p", "xi", "m", "reference")
OF_OPTIMA = ("index", "m", "cost", "status")
OF_TIMINGS = ("index", "reference_build", "reference_solve")
STAGES = [one.name for one in MESSAGES["Timing"] if one.name != "index"]


class OptimumTotals:
    """Gaps to the optimum at the ticks that have one; it is looked for at every `every`-th tick, at none for 0."""

    def __init__(self, scenario: Scenario, every: int):
        self._scenario, self._every = scenario, every
        self._gap, self._leaders, self._cost, self._spread = (Samples() for _ in range(4))
        self._sensing: Samples | None = Samples()
        self._true = TrueOptimum(scenario)
        self._ticks = self._not_ok = 0
        self._statuses: dict[str, int] = {}
        self._joined = IndexJoin(complete=True)

    def add_ticks(self, columns: Columns) -> None:
        """Take the next ticks, one or more."""
        self._ticks += len(columns["time"])
        self._not_ok += int(np.count_nonzero(columns["status"] != "ok"))
        self._spread.add(columns["consensus_spread"])
        chosen = columns["index"] % self._every == 0 if self._every else np.zeros(len(columns["index"]), dtype=bool)
        self._take(self._joined.first({name: columns[name][chosen] for name in OF_TICKS}, int(columns["index"][-1])))

    def add_optima(self, columns: Columns) -> None:
        """Take the next optima. Raises MissingRowError for one at a tick that was not looked at."""
        self._take(self._joined.second({name: columns[name] for name in OF_OPTIMA}))

    def fields(self) -> dict[str, Any]:
        """Return the metrics by name."""
        solves = sum(self._statuses.values())
        shares = {one: self._statuses.get(one, 0) / solves if solves else math.nan for one in ("infeasible", "failed")}
        return {
            "optimality_gap_m": self._gap.statistics(),
            "leader_optimality_gap_m": self._leaders.statistics(),
            "cost_gap_m2": self._cost.statistics(),
            "sensing_gap_m": (self._sensing or Samples()).statistics(),
            "consensus_spread_m": self._spread.statistics(),
            "governor_not_ok_share": self._not_ok / self._ticks,
            "reference_ticks": solves,
            "reference_infeasible_share": shares["infeasible"],
            "reference_failed_share": shares["failed"],
        }

    def _take(self, pairs: Iterable[tuple[Columns, Columns]]) -> None:
        for ticks, optima in pairs:
            self._add(ticks, optima)

    def _add(self, ticks: Columns, optima: Columns) -> None:
        for status in optima["status"].tolist():
            self._statuses[status] = self._statuses.get(status, 0) + 1
        solved = optima["status"] == "solved"
        m, star = ticks["m"][solved], optima["m"][solved]
        p, xi, r = (ticks[name][solved] for name in ("p", "xi", "reference"))
        leaders, reach = np.array(self._scenario.team.leaders) - 1, self._scenario.governor.reference_range
        gap = np.linalg.norm(m - star[:, None, :], axis=-1)
        near = np.array([near_references(p[row], r[row], reach)[leaders] for row in range(len(r))])
        cost = np.sum((near.reshape(-1, len(leaders), 2) - m[:, leaders]) ** 2, axis=(1, 2))
        self._gap.add(gap)
        self._leaders.add(gap[:, leaders])
        self._cost.add(cost - optima["cost"][solved])
        true = self._true.solve(p, xi, r, m[:, leaders].mean(axis=1)) if self._sensing else None
        if true is None:  # nor for the rest of the run
            self._sensing = None
        elif self._sensing:
            away = np.linalg.norm(star - true, axis=1)
            self._sensing.add(away[np.isfinite(away)])


class WallClockTotals:
    """Time of the governor at all ticks, of the reference where there is one, and of all stages together."""

    def __init__(self, with_optima: bool) -> None:
        self._with_optima = with_optima
        self._govern, self._build, self._solve = (Samples() for _ in range(3))
        self._spent = dict.fromkeys(STAGES, 0.0)
        self._joined = IndexJoin(complete=False)

    def add_timings(self, columns: Columns) -> None:
        """Take the next timings."""
        self._govern.add(columns["govern"])
        for stage in STAGES:
            self._spent[stage] += float(np.nansum(columns[stage]))
        if self._with_optima and len(columns["index"]):
            self._take(self._joined.first({name: columns[name] for name in OF_TIMINGS}, int(columns["index"][-1])))

    def add_optima(self, columns: Columns) -> None:
        """Take the next optima."""
        self._take(self._joined.second({"index": columns["index"]}))

    def fields(self, simulated: float) -> dict[str, Any]:
        """Return the metrics by name; `simulated` is the run's length [s]."""
        spent = float(sum(self._spent.values()))
        return {
            "governor_ms": _milliseconds(self._govern),
            "reference_build_ms": _milliseconds(self._build),
            "reference_solve_ms": _milliseconds(self._solve),
            "real_time_factor": simulated / spent if spent else math.nan,
        }

    def _take(self, pairs: Iterable[tuple[Columns, Columns]]) -> None:
        for timings, _ in pairs:
            self._build.add(timings["reference_build"])
            self._solve.add(timings["reference_solve"])


def _milliseconds(samples: Samples) -> WallClock:
    return WallClock(1e3 * samples.percentile(50), 1e3 * samples.percentile(95))
