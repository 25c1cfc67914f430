"""A benchmark's logs again: replayed bit for bit, and the table made from them alone."""

from __future__ import annotations

import os
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pbrg_mj.api.logs import metrics_of
from pbrg_mj.api.replay import TOLERANCE, verify
from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.plugin_failures import take_thread_failure
from pbrg_mj.studies.backends import in_processes
from pbrg_mj.studies.bench.bench import FILES, TABLE, Bench
from pbrg_mj.studies.bench.release import Release, check_release, differing_logs
from pbrg_mj.studies.bench.suite import SCENARIOS, Suite, bundled_keys, read_suite
from pbrg_mj.studies.bench.table import bench_runs
from pbrg_mj.studies.run_task import Record, numbers, silent, timings
from pbrg_mj.studies.runner import LOGS, Watch, no_progress
from pbrg_mj.studies.task import Task
from pbrg_mj.studies.worker import become_worker, catch_thread_failures
from pbrg_mj.text import counted

# Of a suite: all but who takes part.
WORLDS = ("scenario", "train", "held_out", "seed_stride", "duration", "set", "networks")
# What a governor may set in them: another key, such as network.loss, makes worlds of its own.
GOVERNOR_SECTIONS = {"governor", "control"}


@dataclass(frozen=True)
class BenchVerification:
    """What a benchmark's folder proved to be."""

    bench: Bench  # made from the logs
    problems: tuple[str, ...]  # a line each
    suite: str | None  # whose worlds these are, as `pbrg bench` takes it: standard --quick; None: worlds of its own
    logs: int  # runs that have one
    deviating: int  # of these: made elsewhere, and replayed to other bits within the tolerance
    table: bool  # whether there is a `table.md`
    release: Release | None = None  # the manifest whose files these are, if there is one

    @property
    def ok(self) -> bool:
        """Whether all logs that are there replay and the table, if there is one, is what they give."""
        return not self.problems

    def verdict(self) -> str:
        """Return in one line what was verified, and what there was not."""
        if not self.ok:
            return "not verified"
        runs = counted(len(self.bench.runs), "run")
        whole = self.logs == len(self.bench.runs)
        parts = ["every log replays" if whole else f"{self.logs} of {runs} have a log that replays, the rest none"]
        if self.deviating:
            parts.append(f"{self.deviating} of them from elsewhere to other bits within {TOLERANCE:g}")
        parts.append("and the table agrees with the logs" if self.table else f"and there is no {TABLE} to compare")
        return ", ".join(parts)


class _Verified(NamedTuple):
    """What a run's log proved to be, and what it gives for the table."""

    record: Record
    timings: Record
    problem: str | None = None
    deviating: bool = False


def verify_bench(
    folder: str | Path, *, against: str | Path | None = None, jobs: int | None = None, watch: Watch = no_progress
) -> BenchVerification:
    """Replay the logs of a benchmark's folder, or of a submission: a suite's file and `logs/`.

    Each log must hold the suite's scenario for its name and replay bit for bit; the table is made from the logs alone
    and compared with `table.md`, if that is there. A run without a log counts as failed. The manifest of a release is
    checked before all this: raises PbrgError when the files are not those that it names. `against` is the manifest of a
    release made elsewhere, whose logs must have the same messages. Logs are replayed in `jobs` processes, one for each
    core if not given. Raises InputError when the folder has no suite or no log of its runs, or its suite or a manifest
    is wrong here.
    """
    folder = Path(folder)
    release = check_release(folder)
    problems = [] if against is None else list(differing_logs(folder, Path(against)))
    there = [quick for quick, name in FILES.items() if (folder / name).is_file()]
    if len(there) != 1:
        raise InputError(f"has no suite; required: one of {', '.join(FILES.values())}", file=str(folder))
    suite = read_suite(folder / FILES[there[0]], quick=there[0], copies=folder / SCENARIOS)
    if not any((folder / LOGS / name).is_file() for name in suite.logs):
        raise InputError(f"has no log of its suite's runs; required: such as {LOGS}/{suite.logs[0]}", file=str(folder))
    verified = _verify_logs([folder / LOGS / name for name in suite.logs], suite.tasks, jobs, len(problems), watch)
    problems += [f"{LOGS}/{n}: {one.problem}" for n, one in zip(suite.logs, verified, strict=True) if one.problem]
    known = {f"{LOGS}/{name}" for name in suite.logs}
    found = (f"{LOGS}/{path.name}" for path in sorted((folder / LOGS).glob("*.mcap")))
    problems += (f"{name}: no run of the suite has this name" for name in found if name not in known)
    results = [(one.record, one.timings) for one in verified]
    made, deviating = Bench(suite, folder, tuple(bench_runs(suite, results))), sum(one.deviating for one in verified)
    table, logs = (folder / TABLE).is_file(), sum((folder / LOGS / name).is_file() for name in suite.logs)
    if table and (folder / TABLE).read_bytes() != made.markdown().encode():
        problems.append(f"{TABLE}: is not what the logs give")
    return BenchVerification(made, tuple(problems), _bundled(suite), logs, deviating, table, release)


def _verify_logs(
    logs: Sequence[Path], tasks: Sequence[Task], jobs: int | None, problems: int, watch: Watch
) -> list[_Verified]:
    """Return what each log proved to be; `problems` are those that are known before."""
    there = [(index, log, tasks[index]) for index, log in enumerate(logs) if log.is_file()]
    found = [_Verified({"status": "failed", "error": "no log"}, {}) for _ in logs]
    over = len(logs) - len(there)
    watch(over, len(logs), problems)
    with closing(_each_verified(there, min(jobs or os.cpu_count() or 1, len(there)))) as results:
        for index, one, thread_failure in results:
            if thread_failure is not None:
                take_thread_failure(thread_failure)
            found[index] = one
            over, problems = over + 1, problems + (one.problem is not None)
            watch(over, len(logs), problems)
    return found


def _each_verified(
    there: Sequence[tuple[int, Path, Task]], jobs: int
) -> Generator[tuple[int, _Verified, str | None], None, None]:
    if jobs > 1:
        yield from in_processes(_verify_in_worker, there, jobs)
    else:
        for index, log, task in there:
            yield index, _verify(log, task), None


def _verify_in_worker(
    index: int, log: Path, task: Task, *, parent: int, place: str
) -> tuple[int, _Verified, str | None]:
    """Verify a log in a process that works for another one, which is told what a plug-in's thread raises meanwhile."""
    become_worker(parent, place)
    with catch_thread_failures() as failures:
        found = _verify(log, task)
    return index, found, next(iter(failures), None)


def _verify(log: Path, task: Task) -> _Verified:
    """Hold a log to its run, replay it, and take its numbers."""
    with silent():
        problem, deviating = _replay(log, task)
        try:
            metrics = metrics_of(log)
        except PbrgError as error:
            return _Verified({"status": "failed", "error": str(error)}, {}, problem, deviating)
    return _Verified({"status": "ok", "error": None, **numbers(metrics)}, timings(metrics), problem, deviating)


def _replay(log: Path, task: Task) -> tuple[str | None, bool]:
    """Return what is wrong with a log, and whether it replays to other bits."""
    try:
        header = read_header(log)
        if header.scenario != task.scenario().settings:
            return "is of another scenario than the suite's", False
        if header.processes:  # whose messages are replayed as if all had come
            return "its robots were processes of their own, which those of a suite are not", False
        found = verify(log)
    except PbrgError as error:
        return str(error), False
    if not found.ok or not found.found.complete:
        return found.lines()[0], False
    return None, found.verdict != "identical"


def _bundled(suite: Suite) -> str | None:
    """Return the bundled suite with the same worlds, with `--quick` where they are those of its smaller one."""
    governors = suite.file.keys.governors.values()
    sections = {key.split(".")[0] for entry in governors for key in entry.settings}
    if not sections <= GOVERNOR_SECTIONS or not all(task.source.is_bundled for task in suite.tasks):
        return None

    def worlds(keys: Any) -> list[Any]:
        return [getattr(keys, name) for name in WORLDS]

    for quick, option in ((False, ""), (True, " --quick")):
        for name, keys in bundled_keys(quick=quick).items():
            if worlds(keys) == worlds(suite.file.keys):
                return name + option
    return None
