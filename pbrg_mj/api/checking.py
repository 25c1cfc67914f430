"""Whether a governor of one's own keeps the protocol."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pbrg_mj.api.scenario import Scenario, as_scenario
from pbrg_mj.governor import check
from pbrg_mj.governor.check import GovernorReport
from pbrg_mj.governor.messaging.program import RobotProgram
from pbrg_mj.governor.problem.interface import Governor


def check_governor(
    build: Callable[..., Governor | RobotProgram] | Governor | RobotProgram,
    scenario: Scenario | str | Path = "paper/simulation_near",
    options: Mapping[str, Any] | None = None,
) -> GovernorReport:
    """Test a governor, or the build function of one, on made problems of a scenario's team; `str(report)` lists it all.

    A robot program is run on all robots: it is told by its methods, its build function by a first parameter `facts`. It
    is tested besides for knowing nothing of other robots while every message is lost.

    It answers all problems with arrays of the right shapes, finite numbers, a known status, and counts from 0 on; it
    writes into nothing that it is given; the same problem and memory give the same answer.

    Raises PlugInError, whose text is the report, when it does not; InputError for options that do not fit.
    """
    return check.check_governor(build, as_scenario(scenario).settings, options)
