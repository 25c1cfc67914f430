"""The metrics of a run. docs/metrics.md defines each with its formula."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.avoidance import MovingContactTotals, with_avoidance
from pbrg_mj.analysis.metrics.binding import bindings, ticks_needed
from pbrg_mj.analysis.metrics.certificate_totals import CertificateTotals
from pbrg_mj.analysis.metrics.margins import true_margin
from pbrg_mj.analysis.metrics.optimum_totals import OptimumTotals, WallClockTotals
from pbrg_mj.analysis.metrics.outcome import Outcome, final_target, outcome
from pbrg_mj.analysis.metrics.per_tick import ticks_of_a_block
from pbrg_mj.analysis.metrics.safety_totals import NetworkTotals, SafetyTotals
from pbrg_mj.analysis.metrics.samples import Statistics, WallClock
from pbrg_mj.analysis.metrics.settling import Settling
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.column_store import Columns
from pbrg_mj.log.read.run import Run, TickSeries
from pbrg_mj.scenario.schema import Scenario

AT_REST = {"converged", "stuck"}
RENAMED_METRICS = {"settling_time_violated_too_s": "settling_time_including_violated_s"}
"""Earlier names, in files of studies and in their tables -> those of today."""


@dataclass(frozen=True)
class RunMetrics:
    """Everything `compare` prints; units in the names. NaN stands for: does not apply to this run."""

    log: str
    scenario: str
    plant: str
    governor: str
    centralized: bool
    seed: int
    robots: int
    damage: str | None
    ticks: int
    duration_s: float
    asked_s: float
    ended: str
    outcome: str
    reason: str | None
    violation_robot: int | None
    violation_time_s: float | None
    violation_kind: str | None
    target_x_m: float
    target_y_m: float
    terminal_gap_m: float
    settling_time_s: float
    settling_time_including_violated_s: float
    closing_rate_m_s: float
    arrival_time_s: float
    extrapolated_gap_m: float
    binding: tuple[str, ...]
    true_margin_min_m: float
    rest_margin_m: float
    moving_margin_min_m: float
    robot_gap_min_m: float
    wall_contacts: int | None
    wall_contact_s: float
    moving_contacts: int | None
    moving_contact_s: float
    moving_contacts_avoidable: int | None
    robot_contacts: int | None
    robot_contact_s: float
    sensed_margin_min_m: float
    certificate_worst_m: float
    certificate_violated_share: float
    directional_ball_worst_m: float
    directional_ball_violated_share: float
    predictive_worst_m: float
    predictive_violated_share: float
    own_certificate: str | None
    own_certificate_violated_share: float
    own_certificate_horizon_s: float
    first_half_space_s: float
    xi_max_m: float
    winding_up_s: float
    optimality_gap_m: Statistics
    leader_optimality_gap_m: Statistics
    cost_gap_m2: Statistics
    sensing_gap_m: Statistics
    consensus_spread_m: Statistics
    governor_not_ok_share: float
    reference_ticks: int
    reference_infeasible_share: float
    reference_failed_share: float
    rounds_per_tick: float
    sent_per_robot_per_tick_bytes: float
    sent_per_robot_per_second_bytes: float
    sent_per_robot_total_bytes: float
    pre_stabiliser_per_robot_per_tick_bytes: float
    governor_ms: WallClock
    reference_build_ms: WallClock
    reference_solve_ms: WallClock
    real_time_factor: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain nested data for JSON: NaN and infinities are None."""
        return _plain(asdict(self))


class MetricTotals:
    """What is summed up over a whole run, its log given a block of columns at a time.

    Optima are looked for at every `every`-th tick alone, at none for 0.
    """

    def __init__(self, scenario: Scenario, every: int):
        self.safety, self.certificates = SafetyTotals(scenario), CertificateTotals(scenario)
        self.moving = MovingContactTotals(scenario)
        self.network, self.settling = NetworkTotals(scenario), Settling(scenario)
        self.optimum, self.wall_clock = OptimumTotals(scenario, every), WallClockTotals(every > 0)

    # A diverged run overflows here; its NaN and inf are the answer.
    @np.errstate(all="ignore")
    def add_ticks(self, columns: Columns) -> None:
        """Take the next ticks."""
        ticks = TickSeries.of(columns)
        if len(ticks.time):
            for part in (self.safety, self.moving, self.certificates, self.network, self.settling):
                part.add(ticks)
            self.optimum.add_ticks(columns)

    @np.errstate(all="ignore")
    def add_optima(self, columns: Columns) -> None:
        """Take the next optima. Raises MissingRowError for one at a tick that was not looked at."""
        self.optimum.add_optima(columns)
        self.wall_clock.add_optima(columns)

    def add_timings(self, columns: Columns) -> None:
        """Take the next timings."""
        self.wall_clock.add_timings(columns)


def metrics(run: Run) -> RunMetrics:
    """Return the metrics of a run. Raises InputError when the log holds no tick."""
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    totals = MetricTotals(run.scenario, 1)
    many = ticks_of_a_block(run)
    for first in range(0, len(run.ticks.index), many):
        part = run.part(first, first + many)
        totals.add_ticks(vars(part.ticks))
        totals.add_optima(vars(part.optima))
        totals.add_timings(vars(part.timings))
    outcome_run = replace(run, ticks=run.ticks.without_cache(), optima=run.optima.without_cache())
    return metrics_from_totals(totals, outcome_run, _end_of(run))


def _end_of(run: Run) -> Run:
    """Return the last ticks and the last optimum: `bindings` needs no more."""
    first, last = len(run.ticks.index) - ticks_needed(run.scenario), len(run.optima.index) - 1
    return replace(run, ticks=run.ticks.rows(max(first, 0)), optima=run.optima.rows(max(last, 0)))


@np.errstate(all="ignore")
def metrics_from_totals(totals: MetricTotals, outcome_run: Run, end: Run) -> RunMetrics:
    """Return the metrics of a run whose ticks are in the totals.

    `outcome_run` has the rows that decide the outcome, and the first one; `end` all columns of the last ones.
    """
    ended, time, met = outcome(outcome_run), outcome_run.ticks.time, totals.moving.first_contacts()
    return RunMetrics(
        **_identity(outcome_run),
        **_end(outcome_run, with_avoidance(ended, met), totals.settling),
        **totals.safety.fields(outcome_run.absent),
        moving_contacts_avoidable=None if "moving_contact" in outcome_run.absent else sum(one.avoidable for one in met),
        **totals.certificates.fields(),
        **totals.optimum.fields(),
        **totals.network.fields(outcome_run.centralized),
        **totals.wall_clock.fields(float(time[-1] - time[0])),
        binding=tuple(one.text for one in bindings(end)),
    )


def _identity(run: Run) -> dict[str, Any]:
    scenario, time = run.scenario, run.ticks.time
    return {
        "log": run.path,
        "scenario": run.name,
        "plant": scenario.plant,
        "governor": scenario.governor.kind,
        "centralized": run.centralized,
        "seed": scenario.seed,
        "robots": scenario.robots,
        "damage": run.damage,
        "ticks": run.length,
        "duration_s": float(time[-1] - time[0]),
        "asked_s": scenario.timing.duration,
        "ended": run.ending_text,
    }


def _end(run: Run, end: Outcome, settling: Settling) -> dict[str, Any]:
    point = final_target(run).point
    scenario, (x, y) = run.scenario, (math.nan, math.nan) if point is None else map(float, point)
    centre = np.mean(run.ticks.hand_true[-1] - np.array(scenario.team.formation), axis=0)
    margin = true_margin(run.ticks, scenario)[-1]
    return {
        "outcome": end.word,
        "reason": end.reason,
        "violation_robot": end.robot,
        "violation_time_s": end.time,
        "violation_kind": end.kind,
        "target_x_m": x,
        "target_y_m": y,
        "terminal_gap_m": float(np.linalg.norm(centre - (x, y))),
        "settling_time_s": settling.time() if end.word == "converged" else math.nan,
        "settling_time_including_violated_s": _settled(scenario, end, settling),
        "closing_rate_m_s": end.trend.rate if end.trend else math.nan,
        "arrival_time_s": end.trend.arrival if end.trend else math.nan,
        "extrapolated_gap_m": end.trend.limit if end.trend else math.nan,
        "rest_margin_m": float(margin.min()) if end.word in AT_REST else math.nan,
    }


def _settled(scenario: Scenario, end: Outcome, settling: Settling) -> float:
    """Return the settling time of a run that converged, or of one that would have, had it violated nothing."""
    if end.word == "converged":
        return settling.time()
    return settling.time_held(scenario.outcome.rest_time) if end.word == "violated" else math.nan


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
