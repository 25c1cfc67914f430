"""Every mutant is validated, and run for a few ticks if it is valid."""

from __future__ import annotations

import contextlib
import io
import shlex
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from scripts.fuzz.mutants import Mutant, mutant
from scripts.fuzz.sandbox import run_apart
from scripts.fuzz.verdict import Failure, fault

FILE, LOG = "mutant.yaml", "mutant.mcap"
TICKS = 5  # of a run, at most
WARM = ("paper/experiment_near", "paper/simulation_near", "network/lossy", "team/speed_limited", "obstacles/box")


def warm_up() -> None:
    """Import all, and compile or load the kernels that most runs need, before the processes part."""
    for name in WARM:
        main(["run", name, "--duration", "0.3", "--quiet", "-o", LOG])


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Validate and run the mutant of that number in the current folder; yield what went wrong."""
    one = mutant(seed)
    Path(FILE).write_bytes(one.content)
    Path(LOG).unlink(missing_ok=True)
    arguments = ["run", FILE, "-o", LOG, "--json", *(part for text in one.overrides for part in ("--set", text))]
    ending = run_apart(lambda: _validate_and_run(seed, one, arguments))
    ran = bool(one.overrides) or ending.stdout.startswith("{")
    command = "run" if ran else "validate"
    codes[f"{command} {ending.code}"] += 1
    found = fault(ending, _left(), json_wanted=ran)
    if found:
        shown = shlex.join(arguments if ran else ["validate", FILE])
        yield Failure(seed, f"{command}: {found[0]}", f"pbrg {shown} # {one.origin}"[:600], found[1])


def _validate_and_run(seed: int, one: Mutant, arguments: list[str]) -> int:
    """Run a scenario for a few ticks; one of a file alone must be valid first."""
    if not one.overrides:
        with contextlib.redirect_stdout(io.StringIO()):
            code = main(["validate", FILE])
        if code:
            return code
    return main([*arguments, *_cut(seed, one)])


def _cut(seed: int, one: Mutant) -> list[str]:
    """Return the option that ends a run after a few ticks, unless the scenario cannot be read."""
    ticks = int(np.random.default_rng((13, seed)).integers(1, TICKS + 1))
    with contextlib.suppress(pbrg.InputError, RecursionError):  # the run says it as well
        timing = pbrg.load(FILE, one.overrides).settings.timing
        return ["--duration", repr(min(timing.duration, ticks * timing.tick))]
    return []


def _left() -> list[str]:
    return [path.name for path in Path.cwd().iterdir() if path.name != FILE]


def _shown(arguments: list[str], one: Mutant) -> str:
    return f"pbrg {shlex.join(arguments)} # {one.origin}"[:600]
