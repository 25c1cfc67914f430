"""`pbrg robot`."""

from __future__ import annotations

from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_scenario
from pbrg_mj.cli.arguments import Duration, Overrides, ScenarioName, ignore_mujoco_gl


def robot(
    scenario: ScenarioName,
    number: Annotated[int, typer.Argument(metavar="ROBOT", help="Which robot, counted from 1.")],
    connect: Annotated[str, typer.Option(metavar="HOST:PORT", help="Where `pbrg run --listen` waits.")],
    seed: Annotated[int | None, typer.Option(help="As of the run.")] = None,
    duration: Duration = None,
    overrides: Overrides = None,
) -> int:
    """Run the program of one robot for a world that `pbrg run --listen` simulates, perhaps on another machine.

    Scenario, seed, duration and overrides are those of the run. Exit code 1 when no world answers or it is gone.
    """
    ignore_mujoco_gl()
    check_scenario(scenario, seed)
    from pbrg_mj.api.simulate import run_robot

    run_robot(pbrg.load(scenario, overrides or (), seed=seed, duration=duration), number, connect)
    return 0
