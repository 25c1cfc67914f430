"""What can be foreseen of a run from its scenario alone."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.registry import round_step
from pbrg_mj.governor.stability import admissible_step
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network


def advice(scenario: Scenario) -> list[str]:
    """Return one line for everything that makes a run likely to fail; empty when nothing is foreseen."""
    if scenario.governor.kind != "distributed":
        return []
    formation = np.array(scenario.team.formation, dtype=float)
    allowed = admissible_step(network(scenario), formation, scenario.governor.alpha)
    step = round_step(scenario)
    if step <= allowed:
        return []
    line = (
        f"a round of {step:.3g} s may be too long for alpha = {scenario.governor.alpha:g} on this graph: "
        f"explicit steps are stable up to {allowed:.2g} s. More governor.rounds, or a smaller governor.step, help"
    )
    return [line]
