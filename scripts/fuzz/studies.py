"""Families of worlds, sweeps, tunings, searches and suites with accidents: each is gone through to its tables.

A study may rightly ask for hours. Here its first runs are made, cut to a few ticks, and stand for the others.
"""

from __future__ import annotations

import json
import shlex
import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pbrg_mj.cli.main import main
from pbrg_mj.studies import backends
from pbrg_mj.studies.run_task import Result, run_task
from pbrg_mj.studies.task import Task
from scripts.fuzz.sandbox import Ending, run_apart
from scripts.fuzz.study_mutants import FILE, LENGTH, OUTPUT, STUDIES, study_command, study_mutant
from scripts.fuzz.verdict import Failure, fault

MADE, MOST = 2, 60  # runs that are made, and after how many the study is interrupted
INTERRUPTED = 130


def warm_up() -> None:
    """Import all, and compile or load the kernels that most runs need, before the processes part."""
    main(["run", "families/combined", "--duration", "0.3", "--quiet", "-o", "warm.mcap"])
    main(["draw", "families/boxes"])
    for command, (text, _) in STUDIES.items():
        Path(FILE).write_text(text)
        _remove_but()
        _main(study_command(command, quick=False))
    _remove_but()


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Give the file of that number to the commands that take it, in the current folder; yield what went wrong."""
    one = study_mutant(seed)
    Path(FILE).write_bytes(one.content)
    for command in one.commands:
        _remove_but()
        ending = run_apart(lambda command=command: _main(command))
        codes[f"{command[0]} {ending.code}"] += 1
        left = [path.name for path in Path.cwd().iterdir() if path.name != FILE]
        found = _fault(ending, left, json_wanted="--json" in command)
        if found:
            yield Failure(
                seed, f"{command[0]}: {found[0]}", f"pbrg {shlex.join(command)} # {one.origin}"[:600], found[1]
            )
        if found or ending.code == 2:
            return


def _fault(ending: Ending, left: Sequence[str], json_wanted: bool) -> tuple[str, str] | None:
    """Return what is wrong with an ending; a study may also end as one that was interrupted."""
    if ending.code == INTERRUPTED and ending.stderr.startswith("interrupted; "):
        return None
    lines = ending.stderr.splitlines(keepends=True)
    told = "".join(line for line in lines if not line.startswith("written: "))
    found = fault(replace(ending, stderr=told), left, json_wanted)
    if found is None and ending.code in (0, 1) and "runs.jsonl" in _files():
        errors = _defects(Path(OUTPUT) / "runs.jsonl")
        return ("a run's error is no wrong input", errors[0]) if errors else None
    return found


def _files() -> list[str]:
    return [one.name for one in Path(OUTPUT).iterdir()] if Path(OUTPUT).is_dir() else []


def _defects(journal: Path) -> list[str]:
    """Return the errors of failed runs that are neither wrong input nor too little memory."""
    records = [json.loads(line).get("record", {}) for line in journal.read_text().splitlines()]
    errors = [one["error"] for one in records if one.get("status") == "failed"]
    return [one for one in errors if not one.startswith(("InputError: ", "MemoryError"))]


def _remove_but() -> None:
    """Remove all but the study's file."""
    for one in Path.cwd().iterdir():
        if one.is_dir():
            shutil.rmtree(one)
        elif one.name != FILE:
            one.unlink()


def _main(command: Sequence[str]) -> int:
    """Run a command, whose study makes its first runs alone, for a few ticks."""
    made: list[Result] = []

    def cut(task: Task, keep_log: bool = False, **_: Any) -> Result:
        if len(made) >= MOST:
            raise KeyboardInterrupt
        short = replace(task, settings={**task.settings, "timing.duration": LENGTH})
        made.append(run_task(short, keep_log) if len(made) < MADE else made[-1])
        return replace(made[-1], digest=task.digest)

    backends.run_task = cut
    try:
        return main(command)
    finally:  # the process may go on with other things
        backends.run_task = run_task
