"""`pbrg batch`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_arrays, check_scenario
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.cli.arguments import Duration, Force, Overrides, ScenarioName, ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.progress import compiling_noted
from pbrg_mj.text import format_significant


def batch(
    scenario: ScenarioName,
    seeds: Annotated[str, typer.Option(metavar="FIRST-LAST", help="Seeds; single ones too: 1-8,20.")] = "1-64",
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="OUT.npz", help="Arrays to write.")] = None,
    force: Force = False,
    duration: Duration = None,
    overrides: Overrides = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Or processes, where worlds differ; one for each core if not given.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> int:
    """Run seeds of a scenario, or worlds of a family, without logs. Exit code 1 when one was violated or diverged."""
    ignore_mujoco_gl()
    wanted = seeds_of(seeds)
    if output is not None:
        check_arrays(output, force=force)
    check_scenario(scenario)
    loaded = pbrg.load(scenario, overrides or (), duration=duration)
    with compiling_noted():
        made = pbrg.batch(loaded, wanted, path=output, force=force, threads=threads or os.cpu_count())
    if json:
        emit_json(made.summary())
    else:
        emit(_text(made.summary()))
    return 1 if made.failed else 0


def _text(numbers: dict[str, Any]) -> str:
    rates, flat = numbers.pop("rates"), {}
    for name, value in numbers.items():
        flat |= {f"{name}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {name: value}
    shown = {
        name: format_significant(value, 4) if isinstance(value, float) else str(value) for name, value in flat.items()
    }
    lines = [f"{name:<40}{value}" for name, value in shown.items()]
    lines += [
        f"{f'share_{name}':<40}{one['share']:.3g} [{one['low']:.3g}, {one['high']:.3g}]" for name, one in rates.items()
    ]
    return "\n".join(lines)
