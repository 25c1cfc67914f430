"""Warnings before a run: keys of `governor` that belong to another kind than the scenario's."""

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


def governor_warnings(scenario: Scenario) -> list[str]:
    """Return a line for each key whose value is not its default, and which the scenario's own kind does not know."""
    governor, default = scenario.governor, Governor()
    if governor.kind not in GOVERNOR.built_in:  # it may look at any key
        return []
    optimizer = governor.optimizer if governor.kind == "certified" else None
    foreign = {key: f"`governor.kind: {kind}`" for key, kind in KINDS.items() if kind != governor.kind}
    foreign |= {key: f"`governor.optimizer: {key}`" for key in OPTIMIZERS if key != optimizer}
    return [
        f"governor.{key} has no effect: it belongs to {whose}"
        for key, whose in foreign.items()
        if getattr(governor, key) != getattr(default, key)
    ]
