"""Every mutant is validated, and run for a few ticks if it is valid."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

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
        Path(LOG).unlink()


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Validate and run the mutant of that number in the current folder; yield what went wrong."""
    one = mutant(seed)
    Path(FILE).write_bytes(one.content)
    for name in _left():  # the log of the case before, or its part
        Path(name).unlink()
    arguments = ["run", FILE, "-o", LOG, "--json", *(part for text in one.overrides for part in ("--set", text))]
    arguments += _cut(seed, one)
    for command in ([["validate", FILE]] if not one.overrides and seed % 4 == 0 else []) + [arguments]:
        ending = run_apart(lambda command=command: main(command))
        codes[f"{command[0]} {ending.code}"] += 1
        found = fault(ending, _left(), json_wanted=command[0] == "run", all_told=command[0] == "validate")
        if found:
            yield Failure(seed, f"{command[0]}: {found[0]}", f"pbrg {shlex.join(command)} # {one.origin}", found[1])
        if found or ending.code:
            return


def _cut(seed: int, one: Mutant) -> list[str]:
    """Return the option that ends a run after a few ticks; of a length that is not whole where the text misleads."""
    ticks = int(np.random.default_rng((13, seed)).integers(1, TICKS + 1))
    given = re.findall(r"\btick\W{1,3}([0-9.e+-]+)", one.content.decode("utf-8", "replace") + " ".join(one.overrides))
    with contextlib.suppress(ValueError):
        return ["--duration", repr(ticks * float(given[-1] if given else 0.01))]
    return []


def _left() -> list[str]:
    return [path.name for path in Path.cwd().iterdir() if path.name != FILE]


def _shown(arguments: list[str], one: Mutant) -> str:
    return f"pbrg {shlex.join(arguments)} # {one.origin}"[:600]
