"""A task run to its record: what the simulation gives, apart from the wall clock's times."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.metrics.samples import Statistics, WallClock
from pbrg_mj.api.simulate import measure, record
from pbrg_mj.errors import ShortageError
from pbrg_mj.log.write.provenance import versions
from pbrg_mj.studies.task import Task
from pbrg_mj.studies.worker import become_worker, catch_thread_failures

MACHINE = ("platform", "processor")  # of the versions: runs may be made on several machines
LEFT_OUT = ("log", "scenario", "seed")  # of the metrics: a record has them already, or they are no property of the run
LONGEST = 500  # characters of an error
Record = dict[str, Any]


@dataclass(frozen=True)
class Result:
    """What became of a task."""

    digest: str
    record: Record  # the same at every repetition
    timings: Record  # wall-clock times [ms]
    versions: Mapping[str, str]
    log: bytes | None = None
    thread_failure: str | None = None  # of a plug-in, where another process made the run


def run_task(task: Task, keep_log: bool = False, place: str | None = None) -> Result:
    """Run a task. A run that fails is a record whose `status` is `failed`, with the `error` in one line.

    `place`: the folder for its files, which stay there if the process is killed. Raises OSError, MemoryError and
    ShortageError when the machine is short of something: that is no property of the run.
    """
    with _folder(place) if keep_log else nullcontext() as folder, silent():
        log = Path(folder) / "run.mcap" if folder else None
        try:
            metrics = record(task.scenario(), log) if log else measure(task.scenario())
        except (OSError, MemoryError, ShortageError):
            raise
        except Exception as error:  # of whatever kind: the other runs go on
            text = " ".join(f"{type(error).__name__}: {error}".split())[:LONGEST]
            return Result(task.digest, {"status": "failed", "error": text}, {}, packages())
        found = {"status": "ok", "error": None, **numbers(metrics)}
        content = log.read_bytes() if log else None
        return Result(task.digest, found, timings(metrics), packages(), content)


def run_task_in_worker(
    task: Task, keep_log: bool = False, parent: int | None = None, place: str | None = None
) -> Result:
    """Run a task in a process that works for another one, which is told what a plug-in's thread raises meanwhile.

    `parent`: the process that wants the run, where this one was started for it; it ends with that one.
    """
    if parent is not None:
        become_worker(parent, place)
    with catch_thread_failures() as failures:
        result = run_task(task, keep_log, place)
    return replace(result, thread_failure=next(iter(failures), None))


def _folder(place: str | None) -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="pbrg-", dir=place)


def numbers(metrics: RunMetrics) -> Record:
    """Return the metrics that are the same at every repetition, those within others as `name.part`."""
    data = metrics.as_dict()
    return _flat({name: data[name] for name in columns(timings=False)})


def timings(metrics: RunMetrics) -> Record:
    """Return the wall-clock times."""
    data = metrics.as_dict()
    return _flat({name: data[name] for name in columns(timings=True)})


@cache
def columns(*, timings: bool) -> tuple[str, ...]:
    """Return the names of the metrics that are wall-clock times, or of all others."""
    hints = get_type_hints(RunMetrics)
    clocks = {name for name, kind in hints.items() if kind is WallClock} | {"real_time_factor"}
    return tuple(one.name for one in fields(RunMetrics) if one.name not in LEFT_OUT and (one.name in clocks) == timings)


@cache
def column_types(*, timings: bool) -> dict[str, type]:
    """Return the type of each number of a record: bool, int, float or str."""
    hints, found = get_type_hints(RunMetrics), {}
    for name in columns(timings=timings):
        kind = hints[name]
        if kind in (Statistics, WallClock):
            found |= {f"{name}.{part.name}": float for part in fields(kind)}
        else:
            found[name] = next((one for one in (bool, int, float) if kind in (one, one | None)), str)
    return found


@cache
def packages() -> dict[str, str]:
    """Return the versions of the code that a run's numbers depend on."""
    return {name: version for name, version in versions().items() if name not in MACHINE}


def _flat(data: Record) -> Record:
    flat: Record = {}
    for name, value in data.items():
        if isinstance(value, dict):
            flat |= {f"{name}.{part}": number for part, number in value.items()}
        else:
            flat[name] = "; ".join(value) if isinstance(value, list | tuple) else value
    return flat


@contextmanager
def silent() -> Iterator[None]:
    """Print no warnings: a study would print them once for every run; `pbrg validate` tells them."""
    logger = logging.getLogger("pbrg_mj")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)
