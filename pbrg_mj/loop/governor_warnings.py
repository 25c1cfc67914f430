"""Warnings before a run: keys of `governor` that belong to another kind than the scenario's, and what a kind lacks."""

from __future__ import annotations

from pbrg_mj.plugins import GOVERNOR
from pbrg_mj.scenario.schema import Governor, Scenario

# Of one kind alone; likewise of the certified governor's optimizers. What the paper's flow has, such as `alpha`, is
# left out: scenarios are written for it, and run with other kinds to compare.
KINDS = {
    "optimizer": "certified",
    "speed_rows": "certified",
    "sight_rows": "certified",
    "rollout_order": "rollout",
    "barrier_gain": "cbf",
    "field_gain": "potential_field",
    "field_range": "potential_field",
}
OPTIMIZERS = ("nids", "admm", "flow_in_m")
COMPARED = ("rollout", "centralized", "cbf", "potential_field")
"""Kinds without a distance by default that are compared with the certified governor, which has one. To the paper's, and
to none, robots are no obstacles: that is as it shall be."""


def governor_warnings(scenario: Scenario) -> list[str]:
    """Return a line for each key without effect, and one where `control.separation: auto` keeps no robots apart."""
    if scenario.governor.kind not in GOVERNOR.built_in:  # it may look at any key, and keep robots apart itself
        return []
    return [*_keys_without_effect(scenario.governor), *_robots_are_no_obstacles(scenario)]


def _keys_without_effect(governor: Governor) -> list[str]:
    """Return a line for each key whose value is not its default, and which the governor's kind does not know."""
    default = Governor()
    optimizer = governor.optimizer if governor.kind == "certified" else None
    foreign = {key: f"`governor.kind: {kind}`" for key, kind in KINDS.items() if kind != governor.kind}
    foreign |= {key: f"`governor.optimizer: {key}`" for key in OPTIMIZERS if key != optimizer}
    return [
        f"governor.{key} has no effect: it belongs to {whose}"
        for key, whose in foreign.items()
        if getattr(governor, key) != getattr(default, key)
    ]


def _robots_are_no_obstacles(scenario: Scenario) -> list[str]:
    """Return a line where points, which the recommended set-up has, come with a kind for which `auto` is null."""
    by_default = scenario.estimator.source == "points" and scenario.control.separation == "auto"
    if scenario.governor.kind not in COMPARED or not by_default or len(scenario.team.start) == 1:
        return []
    kind = f"`governor.kind: {scenario.governor.kind}`"
    lacks = "nothing keeps robots off each other, and no filter off what stands; a distance [m] does both"
    return [f"control.separation: auto is null with {kind}: {lacks}"]
