"""A benchmark's logs again: replayed bit for bit, and the table made from them alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrg_mj.api.logs import metrics_of
from pbrg_mj.api.replay import verify
from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.studies.bench.bench import FILES, TABLE, Bench
from pbrg_mj.studies.bench.release import Release, check_release, differing_logs
from pbrg_mj.studies.bench.suite import SCENARIOS, Suite, bundled_keys, read_suite
from pbrg_mj.studies.bench.table import bench_runs
from pbrg_mj.studies.run_task import Record, numbers, timings
from pbrg_mj.studies.runner import LOGS, Watch, no_progress
from pbrg_mj.studies.task import Task

# Of a suite: all but who takes part.
WORLDS = ("scenario", "train", "held_out", "seed_stride", "duration", "set", "networks")


@dataclass(frozen=True)
class BenchVerification:
    """What a benchmark's folder proved to be."""

    bench: Bench  # made from the logs
    problems: tuple[str, ...]  # a line each
    suite: str | None  # whose worlds these are, as `pbrg bench` takes it: standard --quick; None: worlds of its own
    release: Release | None = None  # the manifest whose files these are, if there is one

    @property
    def ok(self) -> bool:
        """Whether all logs replay and the table is what they give."""
        return not self.problems


def verify_bench(
    folder: str | Path, *, against: str | Path | None = None, watch: Watch = no_progress
) -> BenchVerification:
    """Replay the logs of a benchmark's folder, or of a submission: a suite's file and `logs/`.

    Each log must hold the suite's scenario for its name and replay bit for bit; the table is made from the logs alone
    and compared with `table.md`, if that is there. A run without a log counts as failed. The manifest of a release is
    checked before all this: raises PbrgError when the files are not those that it names. `against` is the manifest of a
    release made elsewhere, whose logs must have the same messages. Raises InputError when the folder has no suite, or
    its suite or a manifest is wrong here.
    """
    folder = Path(folder)
    release = check_release(folder)
    problems = [] if against is None else list(differing_logs(folder, Path(against)))
    there = [quick for quick, name in FILES.items() if (folder / name).is_file()]
    if len(there) != 1:
        raise InputError(f"has no suite; required: one of {', '.join(FILES.values())}", file=str(folder))
    suite = read_suite(folder / FILES[there[0]], quick=there[0], copies=folder / SCENARIOS)
    results: list[tuple[Record, Record]] = []
    for task, name in zip(suite.tasks, suite.logs, strict=True):
        watch(len(results), len(suite.tasks), len(problems))
        log = folder / LOGS / name
        if not log.is_file():
            results.append(({"status": "failed", "error": "no log"}, {}))
            continue
        problems += (f"{LOGS}/{name}: {problem}" for problem in _problems(log, task))
        results.append(_numbers(log))
    known = {f"{LOGS}/{name}" for name in suite.logs}
    found = (f"{LOGS}/{path.name}" for path in sorted((folder / LOGS).glob("*.mcap")))
    problems += (f"{name}: no run of the suite has this name" for name in found if name not in known)
    made = Bench(suite, folder, tuple(bench_runs(suite, results)))
    if (folder / TABLE).is_file() and (folder / TABLE).read_text(encoding="utf-8") != made.markdown():
        problems.append(f"{TABLE}: is not what the logs give")
    return BenchVerification(made, tuple(problems), _bundled(suite), release)


def _problems(log: Path, task: Task) -> Iterator[str]:
    """Yield what is wrong with a log."""
    try:
        if read_header(log).scenario != task.scenario().settings:
            yield "is of another scenario than the suite's"
            return
        found = verify(log)
    except PbrgError as error:
        yield str(error)
        return
    if not found.ok or not found.found.complete:
        yield found.lines()[0]


def _numbers(log: Path) -> tuple[Record, Record]:
    try:
        metrics = metrics_of(log)
    except PbrgError as error:
        return {"status": "failed", "error": str(error)}, {}
    return {"status": "ok", "error": None, **numbers(metrics)}, timings(metrics)


def _bundled(suite: Suite) -> str | None:
    """Return the bundled suite with the same worlds, with `--quick` where they are those of its smaller one."""

    def worlds(keys: Any) -> list[Any]:
        return [getattr(keys, name) for name in WORLDS]

    for quick, option in ((False, ""), (True, " --quick")):
        for name, keys in bundled_keys(quick=quick).items():
            if worlds(keys) == worlds(suite.file.keys):
                return name + option
    return None
