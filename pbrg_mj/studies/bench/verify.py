"""A benchmark's logs again: replayed bit for bit, and the table made from them alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pbrg_mj.api.logs import metrics_of
from pbrg_mj.api.replay import TOLERANCE, verify
from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.studies.bench.bench import FILES, TABLE, Bench
from pbrg_mj.studies.bench.release import Release, check_release, differing_logs
from pbrg_mj.studies.bench.suite import SCENARIOS, Suite, bundled_keys, read_suite
from pbrg_mj.studies.bench.table import bench_runs
from pbrg_mj.studies.run_task import Record, numbers, timings
from pbrg_mj.studies.runner import LOGS, Watch, no_progress
from pbrg_mj.studies.task import Task
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


class _Replay(NamedTuple):
    """What the replay of a log found."""

    problem: str | None
    deviating: bool = False


def verify_bench(
    folder: str | Path, *, against: str | Path | None = None, watch: Watch = no_progress
) -> BenchVerification:
    """Replay the logs of a benchmark's folder, or of a submission: a suite's file and `logs/`.

    Each log must hold the suite's scenario for its name and replay bit for bit; the table is made from the logs alone
    and compared with `table.md`, if that is there. A run without a log counts as failed. The manifest of a release is
    checked before all this: raises PbrgError when the files are not those that it names. `against` is the manifest of a
    release made elsewhere, whose logs must have the same messages. Raises InputError when the folder has no suite or no
    log of its runs, or its suite or a manifest is wrong here.
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
    results: list[tuple[Record, Record]] = []
    deviating = 0
    for task, name in zip(suite.tasks, suite.logs, strict=True):
        watch(len(results), len(suite.tasks), len(problems))
        log = folder / LOGS / name
        if not log.is_file():
            results.append(({"status": "failed", "error": "no log"}, {}))
            continue
        replay = _replayed(log, task)
        problems += [f"{LOGS}/{name}: {replay.problem}"] if replay.problem else []
        deviating += replay.deviating
        results.append(_numbers(log))
    known = {f"{LOGS}/{name}" for name in suite.logs}
    found = (f"{LOGS}/{path.name}" for path in sorted((folder / LOGS).glob("*.mcap")))
    problems += (f"{name}: no run of the suite has this name" for name in found if name not in known)
    made = Bench(suite, folder, tuple(bench_runs(suite, results)))
    table, logs = (folder / TABLE).is_file(), sum((folder / LOGS / name).is_file() for name in suite.logs)
    if table and (folder / TABLE).read_bytes() != made.markdown().encode():
        problems.append(f"{TABLE}: is not what the logs give")
    return BenchVerification(made, tuple(problems), _bundled(suite), logs, deviating, table, release)


def _replayed(log: Path, task: Task) -> _Replay:
    """Hold a log to its run, and replay it."""
    try:
        header = read_header(log)
        if header.scenario != task.scenario().settings:
            return _Replay("is of another scenario than the suite's")
        if header.processes:  # whose messages are replayed as if all had come
            return _Replay("its robots were processes of their own, which those of a suite are not")
        found = verify(log)
    except PbrgError as error:
        return _Replay(str(error))
    if not found.ok or not found.found.complete:
        return _Replay(found.lines()[0])
    return _Replay(None, deviating=found.verdict != "identical")


def _numbers(log: Path) -> tuple[Record, Record]:
    try:
        metrics = metrics_of(log)
    except PbrgError as error:
        return {"status": "failed", "error": str(error)}, {}
    return {"status": "ok", "error": None, **numbers(metrics)}, timings(metrics)


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
