"""Warnings before a run: settings of the network that its governor does not feel."""

from __future__ import annotations

from typing import Any

from pbrg_mj.plugins import GOVERNOR, is_centralized
from pbrg_mj.scenario.schema import WITHOUT_GOVERNOR, Scenario
from pbrg_mj.scenario.schema.network import Network

PAPER_ROUND_KEYS = ("exchange", "impedance", "reserve_rounds", "neighbour_timeout")
"""Keys that say how the paper's algorithm bears delay and loss; every other governor has ways of its own."""
OTHER_KEYS = ("pre_stabiliser",)


def network_warnings(scenario: Scenario, given: Any = None) -> list[str]:
    """Return a line that names the keys of `network` which do nothing; `given` is the governor if it is an object."""
    kind, keys = scenario.governor.kind, _changed(scenario.network)
    if is_centralized(kind, given):
        why = f"the governor {kind} is centralized: it sees the whole team and sends no messages"
    elif kind in WITHOUT_GOVERNOR:
        why = f"with `governor.kind: {kind}` robots send each other no messages"
    elif kind == "distributed":
        return []
    else:
        of_others = kind if kind in GOVERNOR.built_in else f"{kind}, a robot program"
        why = f"the paper's algorithm alone knows them, not {of_others}"
        keys = [key for key in keys if key in PAPER_ROUND_KEYS]
    named = ", ".join(f"network.{key}" for key in keys)
    return [f"{named} {'has' if len(keys) == 1 else 'have'} no effect: {why}"] if keys else []


def _changed(network: Network) -> list[str]:
    """Return the keys of the governor's messages that have other values than their defaults."""
    default = Network()
    return [
        key
        for key in type(network).model_fields
        if key not in OTHER_KEYS and getattr(network, key) != getattr(default, key)
    ]
