"""Figures of each of many worlds, and of all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.analysis.metrics.avoidance import MovingContact, MovingContactTotals
from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.governor.certificate.evaluate import NAMES, predicted_rows
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.scenario.schema import Scenario, operator_reference


class WorldMetrics(NamedTuple):
    """What became of one world."""

    seed: int
    robots: int
    simulated_s: float
    touching: bool  # some robot touched what stands still
    touching_moving: bool  # a moving box
    touching_moving_avoidably: bool  # one that the robot could have kept off
    touching_robots: bool  # another robot
    past_a_wall: bool  # some hand point was nearer than the clearance to what stands still
    past_a_moving_box: bool
    diverged: bool
    violated: bool  # by the scenario's rules
    margin_m: float  # least of all hand points to anything but robots, less the clearance; inf without any
    ball_violated_share: float  # of ticks, at what the leaders apply
    directional_ball_violated_share: float
    predictive_violated_share: float  # NaN where it is not evaluated
    final_distance_m: float  # largest ||q_j - b_j - r|| at the end


EVENTS = (
    "violated",
    "touching",
    "touching_moving",
    "touching_moving_avoidably",
    "touching_robots",
    "past_a_wall",
    "past_a_moving_box",
    "diverged",
)
SHARES = tuple(f"{name}_violated_share" for name in NAMES)


def world_metrics(histories: BatchHistories, scenario: Scenario) -> list[WorldMetrics]:
    """Return the figures of each world of a scenario."""
    return [_figures(histories, world, scenario) for world in range(len(histories.seeds))]


def summary(worlds: Sequence[WorldMetrics]) -> dict[str, Any]:
    """Return how many worlds met which fate, and with which 95 % intervals; units in the names."""
    margins = np.array([world.margin_m for world in worlds])
    known = margins[np.isfinite(margins)]
    counts = {name: sum(getattr(world, name) for world in worlds) for name in EVENTS}
    return {
        "worlds": len(worlds),
        "simulated_s": max(world.simulated_s for world in worlds),
        **{f"worlds_{name}": count for name, count in counts.items()},
        "rates": {name: Rate.of(count, len(worlds)).as_dict() for name, count in counts.items()},
        "true_margin_m": _spread(known),
        **{name: _spread(_known(worlds, name)) for name in (*SHARES, "final_distance_m")},
        "worst_seed": worlds[int(margins.argmin())].seed if len(known) else None,
    }


def columns(worlds: Sequence[WorldMetrics]) -> dict[str, np.ndarray]:
    """Return all figures by name (W,), under names that no history has."""
    names = {"seed": "seeds", "robots": "robots", "margin_m": "least_margin_m", "final_distance_m": "final_distance_m"}
    names |= {name: f"world_{name}" for name in EVENTS} | {name: name for name in SHARES}
    return {name: np.array([getattr(world, field) for world in worlds]) for field, name in names.items()}


def _figures(histories: BatchHistories, world: int, scenario: Scenario) -> WorldMetrics:
    margins = histories.wall_margin, histories.moving_margin
    wall, moving = (float(margin[world].min(initial=np.inf)) for margin in margins)
    touching, touching_moving, touching_robots = (
        bool(flags[world].any())
        for flags in (histories.wall_contact, histories.moving_contact, histories.robot_contact)
    )
    rules = scenario.outcome.contacts
    violations = {
        "walls": touching or wall < 0.0,
        "moving": touching_moving or moving < 0.0,
        "robots": touching_robots,
    }
    return WorldMetrics(
        seed=histories.seeds[world],
        robots=histories.hand_world.shape[2],
        simulated_s=float(histories.time[-1]),
        touching=touching,
        touching_moving=touching_moving,
        touching_moving_avoidably=any(one.avoidable for one in _moving_contacts(histories, world, scenario)),
        touching_robots=touching_robots,
        past_a_wall=wall < 0.0,
        past_a_moving_box=moving < 0.0,
        diverged=bool(histories.diverged[world].any()),
        violated=any(found and getattr(rules, kind) == "violation" for kind, found in violations.items()),
        margin_m=min(wall, moving),
        **_violated_shares(histories, world, scenario),
        final_distance_m=_final_distance(histories, world, scenario),
    )


def _moving_contacts(histories: BatchHistories, world: int, scenario: Scenario) -> list[MovingContact]:
    totals = MovingContactTotals(scenario)
    totals.add_arrays(histories.time, histories.hand_world[world], histories.moving_contact[world])
    return totals.first_contacts()


def _violated_shares(histories: BatchHistories, world: int, scenario: Scenario) -> dict[str, float]:
    shares = histories.certificate_violated[world].mean(axis=0)
    if not predicted_rows(scenario).shape[1]:
        shares[NAMES.index("predictive")] = np.nan
    return dict(zip(SHARES, shares.tolist(), strict=True))


def _known(worlds: Sequence[WorldMetrics], name: str) -> np.ndarray:
    values = np.array([getattr(world, name) for world in worlds])
    return values[~np.isnan(values)]


def _final_distance(histories: BatchHistories, world: int, scenario: Scenario) -> float:
    r = operator_reference(scenario.operator, float(histories.time[-1]))
    apart = histories.hand_world[world, -1] - np.array(scenario.team.formation) - r
    return float(np.linalg.norm(apart, axis=1).max())


def _spread(values: np.ndarray) -> dict[str, float] | None:
    if not len(values):
        return None
    return {"min": float(values.min()), "median": float(np.median(values)), "max": float(values.max())}
