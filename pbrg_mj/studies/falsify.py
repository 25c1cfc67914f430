"""A search for a scenario in which a governor fails, and the shortest one that shows it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Unpack

from pydantic import Field

from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.api.scenario import load
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.families.schema import Distribution
from pbrg_mj.scenario.parse.renamed_keys import Renamed
from pbrg_mj.scenario.schema.base import Section
from pbrg_mj.studies.document import StudyFile, read_study
from pbrg_mj.studies.failures import FAILURES, Kind
from pbrg_mj.studies.optimizer import Optimizer, check_bounded
from pbrg_mj.studies.records import rows, write_records
from pbrg_mj.studies.run_task import Record
from pbrg_mj.studies.runner import Part, Runner, RunOptions
from pbrg_mj.studies.shrink import shrunk
from pbrg_mj.studies.sweep_plan import Entries, Seed, Values, always_set, check_settings
from pbrg_mj.studies.task import Source, Task

FILE, FOUND = "search.yaml", "found.yaml"
RENAMED: Renamed = {("at_once",): "batch_size"}
WORST = 1e6  # value of a run that failed: it shows nothing


class SearchKeys(Section):
    """What to search over, and for what."""

    find: Literal["contact", "crossing", "certificate", "stall"] = Field(description="the failure to look for")
    keys: dict[str, Distribution] = Field(
        description="ranges of keys; of a family also `seed`, and keys under `draw`", min_length=1
    )
    duration: Annotated[float, Field(gt=0)] | None = Field(default=None, description="simulated time [s]")
    set: Values = Field(default={}, description="values of keys, the same in all runs")
    batch_size: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=4, description="points chosen before any of them is known: they can run in parallel"
    )
    shrink: Annotated[int, Field(ge=0, le=10_000)] = Field(default=40, description="runs to make what is found shorter")
    seed: Seed = Field(default=1, description="of the search")


@dataclass(frozen=True)
class Falsification:
    """What a search found, or how near it came."""

    folder: Path
    kind: Kind
    runs: int  # of the search
    nearest: float  # least value: below 0 is a failure
    found: Record | None  # the record of the shortest scenario that shows the failure
    shrinking: int = 0  # runs to make it shorter

    @property
    def path(self) -> Path | None:
        """The scenario that shows the failure, ready to run; None if none was found."""
        return self.folder / FOUND if self.found else None

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "find": self.kind,
            "runs": self.runs,
            "nearest": self.nearest,
            "found": str(self.path) if self.path else None,
            "shrinking_runs": self.shrinking,
        }


def falsify(
    scenario: str | Path,
    search: str | Path,
    folder: str | Path,
    *,
    budget: int = 200,
    **options: Unpack[RunOptions],
) -> Falsification:
    """Search the keys of a scenario, or a family's draws, for a failure, in `budget` runs at most.

    The first failure ends the search. It is made shorter: the end is cut off after it, and robots and obstacles are
    left out as long as it shows. `found.yaml` in `folder` is that scenario, `records.parquet` has a row a run. All is
    the same at every repetition, whatever backend and number of jobs. Other arguments, resumption and errors are those
    of `sweep`.
    """
    if budget < 1:
        raise InputError(f"is {budget}; allowed: 1 or more", key="budget")
    read = read_study(search, SearchKeys, RENAMED)
    source = Source.of(str(scenario), Path())
    optimizer = _checked(read, source)
    about = f"# {source.name}, {budget} runs\n".encode()
    with Runner.of(folder, (FILE, about + read.content), **options) as runner:
        return _search(runner, read.keys, source, optimizer, budget)


def _checked(file: StudyFile[SearchKeys], source: Source) -> Optimizer:
    keys = file.keys
    check_bounded(file, keys.keys)
    first = Optimizer(keys.keys, keys.seed).ask(1)[0][1]
    entries: Entries = {("set", key): {key: one} for key, one in always_set(keys).items()}
    entries |= {("keys", key): {key: one} for key, one in first.items() if key != "seed"}
    check_settings(file, source, int(first.get("seed", 1)), entries)
    return Optimizer(keys.keys, keys.seed)


def _search(runner: Runner, keys: SearchKeys, source: Source, optimizer: Optimizer, budget: int) -> Falsification:
    value, always = FAILURES[keys.find], always_set(keys)
    made: list[tuple[Task, tuple[Record, Record]]] = []
    nearest, failing = math.inf, False

    def nearness(record: Record) -> float:
        return value(record) if record["status"] == "ok" else WORST

    while not failing and (left := budget - len(made)):
        asked = optimizer.ask(min(left, keys.batch_size))
        tasks = [_task(source, always | point, len(made) + k) for k, (_, point) in enumerate(asked)]
        failed = sum(record["status"] != "ok" for _, (record, _) in made)
        results = runner.run(tasks, part=Part(len(made), budget, failed), ends=lambda record: nearness(record) < 0)
        made += zip(tasks, results, strict=False)  # none after the first failure
        values = [nearness(record) for record, _ in results]
        optimizer.tell([(trial, one) for (trial, _), one in zip(asked, values, strict=False)])
        nearest, failing = min(nearest, *values), values[-1] < 0
    searched, found, tried = len(made), None, 0
    if failing:
        task, (record, _) = made[-1]
        text, found, tried = shrunk(task.scenario(), record, value, keys.shrink, _runs(runner, source.name, made))
        write_text_atomically(runner.folder / FOUND, text)
        load(runner.folder / FOUND)  # ready to run
    write_records(runner.folder, *rows([task for task, _ in made], [result for _, result in made]))
    return Falsification(runner.folder, keys.find, searched, nearest, found, tried)


def _task(source: Source, settings: Values, trial: int) -> Task:
    labels = {"trial": trial, **{f"keys.{key}": one for key, one in settings.items() if key != "seed"}}
    seed = settings.get("seed", 1)
    return Task(source, {key: one for key, one in settings.items() if key != "seed"}, int(seed), labels)


def _runs(runner: Runner, name: str, made: list[tuple[Task, tuple[Record, Record]]]) -> Callable[[str, int], Record]:
    """Return a function that runs a scenario's text with a seed and gives its record."""

    def run(text: str, seed: int) -> Record:
        task = Task(Source(name, text, FOUND, FOUND), {}, seed, {"trial": len(made)})
        result = runner.run([task], part=Part(len(made)))[0]
        made.append((task, result))
        return result[0]

    return run
