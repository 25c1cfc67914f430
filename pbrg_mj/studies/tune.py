"""Tuning: the values of a governor's own options that are best on training seeds, and what they give on others."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Unpack

from pydantic import Field

from pbrg_mj.analysis.metrics.run_metrics import RENAMED_METRICS
from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.scenario.families.schema import Distribution
from pbrg_mj.scenario.parse.document import write_document
from pbrg_mj.scenario.parse.renamed_keys import Renamed
from pbrg_mj.scenario.schema.base import Section
from pbrg_mj.studies.document import StudyFile, read_study
from pbrg_mj.studies.optimizer import Optimizer, check_bounded
from pbrg_mj.studies.records import rows, write_records
from pbrg_mj.studies.run_task import Record, column_types
from pbrg_mj.studies.runner import Part, Runner, RunOptions
from pbrg_mj.studies.sweep_plan import Entries, Seed, Values, always_set, check_settings, seed_list, sources
from pbrg_mj.studies.task import Task

FILE, TRACE, BEST = "tune.yaml", "trace.json", "best.yaml"
FAILED = ("violated", "diverged")
RENAMED: Renamed = {("at_once",): "batch_size", ("otherwise",): "failure_value"}


class TuneKeys(Section):
    """What to tune, on which runs, and how long to search."""

    scenario: str | tuple[str, ...] = Field(description="a file beside this one, a bundled name, or several")
    seeds: str | Seed | tuple[Seed, ...] = Field(default="1", description="to tune on, such as 1-8,20, or a list")
    held_out: str | Seed | tuple[Seed, ...] | None = Field(
        default=None, description="seeds on which the best values are tried in the end, other ones than `seeds`"
    )
    duration: Annotated[float, Field(gt=0)] | None = Field(default=None, description="simulated time [s]")
    set: Values = Field(default={}, description="values of keys, the same in all runs")
    keys: dict[str, Distribution] = Field(description="ranges of the keys to tune", min_length=1)
    minimize: str = Field(
        default="terminal_gap_m", description="a number of the records; its mean over runs is minimized"
    )
    failure_value: float = Field(
        default=10.0, description="its value in a run that is violated, diverged, fails or has no such number"
    )
    budget: Annotated[int, Field(ge=1, le=100_000)] = Field(default=20, description="how many values are tried")
    batch_size: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=4, description="how many are chosen before any of them is known: they can run in parallel"
    )
    seed: Seed = Field(default=1, description="of the search, not of the runs")


@dataclass(frozen=True)
class Tuning:
    """What a search found."""

    folder: Path
    trace: tuple[Record, ...]  # a trial each: its `keys` and their `value`; the first one has the keys as they were
    best: Record  # of the trace
    held_out: dict[str, float] | None  # the value of the `best` keys and of those `as_given`, on other seeds

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {"best": self.best, "as_given": self.trace[0]["value"], "held_out": self.held_out}


def tune(
    file: str | Path,
    folder: str | Path,
    **options: Unpack[RunOptions],
) -> Tuning:
    """Search the values of keys that are best on training seeds; write them, and all that was tried, into `folder`.

    `best.yaml` has the best values, `trace.json` every trial, `records.parquet` a row a run. The first trial has the
    keys as they are in the scenario, so that the best is no worse on these seeds. All is the same at every repetition,
    whatever the backend and number of jobs. Arguments, resumption and errors are those of `sweep`.
    """
    read = read_study(file, TuneKeys, RENAMED)
    search = _Search(read)
    with Runner.of(folder, (FILE, read.content), **options) as runner:
        return search.run(runner)


class _Search:
    def __init__(self, file: StudyFile[TuneKeys]):
        """Check the file. Raises InputError."""
        keys = self.keys = file.keys
        check_bounded(file, keys.keys)
        self.minimize = RENAMED_METRICS.get(keys.minimize, keys.minimize)
        if column_types(timings=False).get(self.minimize) not in (int, float, bool):
            raise file.error(("minimize",), f"is {keys.minimize!r}; allowed: a number of the records (docs/metrics.md)")
        if not math.isfinite(keys.failure_value):
            raise file.error(("failure_value",), "is not finite")
        self.sources, self.seeds, self.held_out = sources(file), seed_list(file), ()
        if keys.held_out is not None:
            self.held_out = seed_list(file, "held_out")
            if both := set(self.seeds) & set(self.held_out):
                raise file.error(("held_out",), f"has the seed {min(both)} of `seeds`; allowed: other ones")
        self.always = always_set(keys)
        self.optimizer = Optimizer(keys.keys, keys.seed)
        first = Optimizer(keys.keys, keys.seed).ask(1)[0][1]
        entries: Entries = {("set", key): {key: one} for key, one in self.always.items()}
        entries |= {("keys", key): {key: one} for key, one in first.items()}
        for source in self.sources:
            check_settings(file, source, self.seeds[0], entries)
        self.trace: list[Record] = []
        self.made: list[tuple[Task, tuple[Record, Record]]] = []

    def run(self, runner: Runner) -> Tuning:
        """Search, and write what was found."""
        self._try(runner, [{}])
        while left := self.keys.budget - len(self.trace):
            asked = self.optimizer.ask(min(left, self.keys.batch_size))
            values = self._try(runner, [point for _, point in asked])
            self.optimizer.tell([(trial, value) for (trial, _), value in zip(asked, values, strict=True)])
        best = min(self.trace, key=lambda trial: trial["value"])
        held_out = None
        if self.held_out:
            value, given = (self._value(runner, settings, self.held_out) for settings in (best["keys"], {}))
            held_out = {"best": value, "as_given": given}
        found = Tuning(runner.folder, tuple(self.trace), best, held_out)
        self._write(found)
        return found

    def _try(self, runner: Runner, points: Sequence[Values]) -> list[float]:
        runs = len(self.sources) * len(self.seeds)
        total = self.keys.budget * runs
        failed = sum(result[0]["status"] != "ok" for _, result in self.made)
        tasks = [self._tasks(len(self.trace) + k, point, self.seeds) for k, point in enumerate(points)]
        results = iter(runner.run([task for part in tasks for task in part], part=Part(len(self.made), total, failed)))
        values = []
        for point, part in zip(points, tasks, strict=True):
            found = [(task, next(results)) for task in part]
            self.made += found
            values.append(self._mean([result[0] for _, result in found]))
            self.trace.append({"trial": len(self.trace), "keys": point, "value": values[-1]})
        return values

    def _value(self, runner: Runner, settings: Values, seeds: Sequence[int]) -> float:
        tasks = self._tasks("held out", settings, seeds)
        results = runner.run(tasks, part=Part(len(self.made)))
        self.made += zip(tasks, results, strict=True)
        return self._mean([record for record, _ in results])

    def _tasks(self, trial: int | str, settings: Values, seeds: Sequence[int]) -> list[Task]:
        labels = {"trial": str(trial), **{f"keys.{key}": settings.get(key) for key in self.keys.keys}}
        return [Task(source, self.always | settings, seed, labels) for source in self.sources for seed in seeds]

    def _mean(self, records: Sequence[Record]) -> float:
        return math.fsum(self._number(record) for record in records) / len(records)

    def _number(self, record: Record) -> float:
        value = record.get(self.minimize)
        counts = record["status"] == "ok" and record["outcome"] not in FAILED
        return float(value) if counts and value is not None else self.keys.failure_value

    def _write(self, found: Tuning) -> None:
        write_records(found.folder, *rows([task for task, _ in self.made], [result for _, result in self.made]))
        facts = {
            "minimize": self.minimize,
            "budget": self.keys.budget,
            "seeds": list(self.seeds),
            "held_out_seeds": list(self.held_out),
            **found.as_dict(),
            "trials": self.trace,
        }
        write_text_atomically(found.folder / TRACE, json.dumps(facts, indent=1) + "\n")
        write_text_atomically(found.folder / BEST, write_document(found.best["keys"]))
