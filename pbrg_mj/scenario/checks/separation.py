"""Robots of a formation are no nearer than they are to keep apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema import Scenario

ROUNDING = 1e-9  # [m]


def separation(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield two robots of the formation that are nearer than `control.separation`: they could never be there."""
    asked, formation = scenario.control.separation, np.array(scenario.team.formation, dtype=float)
    if asked is None or asked == "auto":
        return
    for j in range(1, len(formation)):
        apart = np.linalg.norm(formation[:j] - formation[j], axis=1)
        i = int(apart.argmin())
        if apart[i] < asked - ROUNDING:
            yield Diagnostic(
                ("control", "separation"),
                f"is {asked:g} m, and robots {i + 1} and {j + 1} of the formation are {apart[i]:.3g} m apart; "
                "allowed: at most what the formation has between any two",
            )
            return
