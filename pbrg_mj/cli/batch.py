"""`pbrg batch`."""

from __future__ import annotations

import os
import re
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.errors import InputError

MOST = 100_000  # seeds in one go


def batch(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A file, or a bundled name (see: pbrg list).")],
    seeds: Annotated[str, typer.Option(metavar="FIRST-LAST", help="Seeds; single ones too: 1-8,20.")] = "1-64",
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="OUT.npz", help="Arrays to write.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time [s]: --set timing.duration=S.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change path.to.key; may be repeated.")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="One for each core if not given.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the batch_metrics as JSON.")] = False,
) -> int:
    """Run many seeds of a scenario side by side, without logs. Exit code 1 when a world was violated or diverged."""
    os.environ.pop("MUJOCO_GL", None)  # see run
    from pbrg_mj.analysis.metrics.batch_metrics import WRITERS, batch_metrics, save_batch
    from pbrg_mj.analysis.output_file import by_suffix
    from pbrg_mj.log.write.writer import check_writable
    from pbrg_mj.loop.batch import BatchSimulation
    from pbrg_mj.scenario.load import load_scenario

    shorthand = [] if duration is None else [f"timing.duration={duration}"]
    loaded = load_scenario(scenario, [*(overrides or ()), *shorthand])
    if output is not None:
        by_suffix(output, WRITERS)
        check_writable(output)
    worlds, began = BatchSimulation(loaded.scenario, seeds_of(seeds), threads), perf_counter()
    histories = worlds.run()
    speed = len(histories.seeds) * float(histories.time[-1]) / (perf_counter() - began)
    numbers = {"scenario": loaded.name, **batch_metrics(histories), "simulated_s_per_s": speed}
    if output is not None:
        save_batch(histories, output)
    if json:
        emit_json(numbers)
    else:
        emit(_text(numbers))
    return 1 if any(numbers[f"worlds_{how}"] for how in ("touching", "past_a_wall", "diverged")) else 0


def seeds_of(text: str) -> tuple[int, ...]:
    """Return the seeds that `1-8,20` names, in that order. Raises InputError for anything else."""
    seeds: dict[int, None] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,19})(?:-(\d{1,19}))?\s*", part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last < 2**63 or last - first >= MOST or len(seeds) + last - first >= MOST:
            allowed = f"allowed: seeds and ranges such as 1-64 or 1-8,20, at most {MOST} in all"
            raise InputError(f"--seeds is {text!r}; {allowed}")
        seeds.update(dict.fromkeys(range(first, last + 1)))
    return tuple(seeds)


def _text(numbers: dict[str, Any]) -> str:
    flat = {}
    for name, value in numbers.items():
        flat |= {f"{name}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {name: value}
    shown = {name: f"{value:.4g}" if isinstance(value, float) else str(value) for name, value in flat.items()}
    return "\n".join(f"{name:<28}{value}" for name, value in shown.items())
