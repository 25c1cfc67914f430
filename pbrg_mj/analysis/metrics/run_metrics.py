"""The metrics of a run. docs/metrics.md defines each with its formula."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pbrg_mj.analysis.metrics.binding import bindings
from pbrg_mj.analysis.metrics.contacts import FIELDS, count_contacts
from pbrg_mj.analysis.metrics.margins import true_margin
from pbrg_mj.analysis.metrics.outcome import final_target, formation_error, last_change, outcome
from pbrg_mj.analysis.metrics.per_tick import (
    certificate_rows,
    integral_state,
    least_sensed_margin,
    per_tick,
    robot_distance,
    sensing,
    sent_per_robot,
)
from pbrg_mj.analysis.metrics.sensing_gap import true_optima
from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.described import described
from pbrg_mj.governor.certificate.evaluate import NAMES, VIOLATED
from pbrg_mj.governor.problem.near_reference import near_references
from pbrg_mj.log.read.run import Run
from pbrg_mj.scenario.checks.world import BODY_RADIUS
from pbrg_mj.scenario.schema import Scenario

AT_REST = {"converged", "stuck"}


@dataclass(frozen=True)
class Statistics:
    """A quantity over time, in the unit its owner's name carries; NaN where there is no sample."""

    mean: float
    p95: float
    final: float


@dataclass(frozen=True)
class WallClock:
    """Wall-clock time per call, in the unit its owner's name carries; NaN without timings."""

    median: float
    p95: float


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
    governor_ms: WallClock
    reference_build_ms: WallClock
    reference_solve_ms: WallClock
    real_time_factor: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain nested data for JSON: NaN and infinities are None."""
        return _plain(asdict(self))


def metrics(run: Run, end: Run | None = None) -> RunMetrics:
    """Return the metrics of a run; `end` is the last part of it, where `run` has not all columns.

    Raises InputError when the log holds no tick.
    """
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    # A diverged run overflows here; its NaN and inf are the answer.
    with np.errstate(all="ignore"):
        return RunMetrics(
            **_identity(run),
            **_end(run),
            **_safety(run),
            **_against_optimum(run),
            **_network(run),
            **_wall_clock(run),
            binding=tuple(one.text for one in bindings(end or run)),
        )


def statistics(values: np.ndarray) -> Statistics:
    """Return mean and 95th percentile of values (S,) or (S, n), and the largest of the last row."""
    if not values.size:
        return Statistics(math.nan, math.nan, math.nan)
    return Statistics(float(np.mean(values)), float(np.percentile(values, 95)), float(np.max(values[-1])))


def least_robot_gap(run: Run) -> float:
    """Return the least distance between the bodies of two robots [m]; NaN for one robot alone.

    Bodies are discs of the robot's radius: 0 is contact. The ideal plant's robots are points; theirs trail them.
    """
    if run.scenario.robots < 2:
        return math.nan
    return float(per_tick(run, robot_distance).min()) - 2 * BODY_RADIUS


def settling_time(run: Run, point: ArrayLike) -> float:
    """Return how long after the last change of r the formation error stays within tolerance [s]; NaN if never."""
    late = np.flatnonzero(~(formation_error(run, point) <= run.scenario.outcome.tolerance))
    settled = late[-1] + 1 if len(late) else 0
    if settled >= len(run.ticks.time):
        return math.nan
    return max(0.0, float(run.ticks.time[settled] - run.ticks.time[last_change(run)]))


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
        "ticks": len(time),
        "duration_s": float(time[-1] - time[0]),
        "asked_s": scenario.timing.duration,
        "ended": run.how_it_ended,
    }


def _end(run: Run) -> dict[str, Any]:
    end, point = outcome(run), final_target(run).point
    x, y = (math.nan, math.nan) if point is None else map(float, point)
    centre = np.mean(run.ticks.hand_true[-1] - np.array(run.scenario.team.formation), axis=0)
    return {
        "outcome": end.word,
        "reason": end.reason,
        "violation_robot": end.robot,
        "violation_time_s": end.time,
        "violation_kind": end.kind,
        "target_x_m": x,
        "target_y_m": y,
        "terminal_gap_m": float(np.linalg.norm(centre - (x, y))),
        "settling_time_s": settling_time(run, (x, y)) if end.word == "converged" else math.nan,
        "closing_rate_m_s": end.trend.rate if end.trend else math.nan,
        "arrival_time_s": end.trend.arrival if end.trend else math.nan,
        "extrapolated_gap_m": end.trend.limit if end.trend else math.nan,
    }


def _safety(run: Run) -> dict[str, Any]:
    margin, sensed = true_margin(run), np.flatnonzero(per_tick(run, sensing))
    return {
        "true_margin_min_m": float(margin.min()),
        "rest_margin_m": float(margin[-1].min()) if outcome(run).word in AT_REST else math.nan,
        "moving_margin_min_m": float(run.ticks.moving_margin.min()),
        "robot_gap_min_m": least_robot_gap(run),
        **_contacts(run),
        "sensed_margin_min_m": float(per_tick(run, least_sensed_margin).min()),
        **_certificates(run),
        "first_half_space_s": float(run.ticks.time[sensed[0]]) if len(sensed) else math.nan,
        "xi_max_m": float(per_tick(run, integral_state).max()),
        "winding_up_s": float(run.ticks.winding_up.any(axis=1).sum() * run.scenario.timing.tick),
    }


def _certificates(run: Run) -> dict[str, Any]:
    """Return the worst value and the violated share of each certificate; keys of the ball are plain `certificate`."""
    rows, own = per_tick(run, certificate_rows), described(run.scenario)
    worst = dict(zip(NAMES, map(float, rows.max(axis=0)), strict=True))
    known = np.where(np.isnan(rows).any(axis=0), np.nan, np.mean(rows > VIOLATED, axis=0))
    shares = dict(zip(NAMES, map(float, known), strict=True))
    prefixes = {name: "certificate" if name == "ball" else name for name in NAMES}
    found = {f"{prefix}_worst_m": worst[name] for name, prefix in prefixes.items()}
    found |= {f"{prefix}_violated_share": shares[name] for name, prefix in prefixes.items()}
    return found | {
        "own_certificate": own.name,
        "own_certificate_violated_share": shares.get(own.name or "", math.nan),
        "own_certificate_horizon_s": own.horizon_s,
    }


def _contacts(run: Run) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind, field in FIELDS.items():
        count = count_contacts(run, kind)
        found |= {f"{field}s": count and count.times, f"{field}_s": count.seconds if count else math.nan}
    return found


def _against_optimum(run: Run) -> dict[str, Any]:
    # A log cut short may hold a reference whose tick is lost.
    known = np.isin(run.optima.index, run.ticks.index)
    status = run.optima.status[known]
    solved = known & (run.optima.status == "solved")
    rows = np.searchsorted(run.ticks.index, run.optima.index[solved])
    m, leaders = run.ticks.m[rows], leaders_of(run.scenario)
    gap = np.linalg.norm(m - run.optima.m[solved][:, None, :], axis=-1)
    reach = run.scenario.governor.reference_range
    r = np.array([near_references(run.ticks.p[row], run.ticks.reference[row], reach)[leaders] for row in rows])
    cost = np.sum((r.reshape(-1, len(leaders), 2) - m[:, leaders]) ** 2, axis=(1, 2))
    return {
        "optimality_gap_m": statistics(gap),
        "leader_optimality_gap_m": statistics(gap[:, leaders]),
        "cost_gap_m2": statistics(cost - run.optima.cost[solved]),
        "sensing_gap_m": statistics(_sensing_gap(run, solved)),
        "consensus_spread_m": statistics(run.ticks.consensus_spread),
        "governor_not_ok_share": float(np.mean(run.ticks.status != "ok")),
        "reference_ticks": len(status),
        "reference_infeasible_share": _share(status == "infeasible"),
        "reference_failed_share": _share(status == "failed"),
    }


def _sensing_gap(run: Run, solved: np.ndarray) -> np.ndarray:
    true = true_optima(run, solved)
    if true is None:
        return np.zeros(0)
    gap = np.linalg.norm(run.optima.m[solved] - true, axis=1)
    return gap[np.isfinite(gap)]


def _network(run: Run) -> dict[str, Any]:
    per_robot = per_tick(run, sent_per_robot)
    if run.centralized:  # what it says of messages nobody has counted
        per_robot = np.full_like(per_robot, np.nan)
    return {
        "rounds_per_tick": float(run.ticks.rounds.mean()),
        "sent_per_robot_per_tick_bytes": float(per_robot.mean()),
        "sent_per_robot_per_second_bytes": float(per_robot.mean() / run.scenario.timing.tick),
        "sent_per_robot_total_bytes": float(per_robot.sum()),
    }


def _wall_clock(run: Run) -> dict[str, Any]:
    t = run.timings
    at_reference = np.isin(t.index, run.optima.index)
    stages = [getattr(t, field.name) for field in fields(t) if field.name != "index"]
    spent = float(sum(np.nansum(stage) for stage in stages))
    simulated = float(run.ticks.time[-1] - run.ticks.time[0])
    return {
        "governor_ms": _wall_clock_ms(t.govern),
        "reference_build_ms": _wall_clock_ms(t.reference_build[at_reference]),
        "reference_solve_ms": _wall_clock_ms(t.reference_solve[at_reference]),
        "real_time_factor": simulated / spent if spent else math.nan,
    }


def leaders_of(scenario: Scenario) -> np.ndarray:
    """Return the leaders' indices, counted from 0."""
    return np.array(scenario.team.leaders) - 1


def _wall_clock_ms(seconds: np.ndarray) -> WallClock:
    if not len(seconds):
        return WallClock(math.nan, math.nan)
    return WallClock(1e3 * float(np.median(seconds)), 1e3 * float(np.percentile(seconds, 95)))


def _share(flags: np.ndarray) -> float:
    return float(np.mean(flags)) if len(flags) else math.nan


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
