"""The runs of a study in a folder: those that are there already are not made again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from itertools import takewhile
from pathlib import Path
from signal import SIGINT
from types import TracebackType
from typing import NamedTuple, Self, TypedDict

from pbrg_mj.analysis.output_file import remove_unfinished, write_atomically
from pbrg_mj.errors import InputError, Interrupted, PbrgError, Stopped, write_error
from pbrg_mj.plugin_failures import take_thread_failure
from pbrg_mj.studies.backends import Backend
from pbrg_mj.studies.journal import FILE, Journal
from pbrg_mj.studies.run_task import Record, Result, packages
from pbrg_mj.studies.task import Task
from pbrg_mj.text import counted

LOGS = "logs"
Ends = Callable[[Record], bool]
"""Whether a run ends the study."""
Watch = Callable[[int, int, int], object]
"""Called with the numbers of runs that are over, of all runs, and of those that failed."""


def no_progress(done: int, total: int, failed: int) -> None:
    """Do nothing: what a study without a progress bar calls."""


class Part(NamedTuple):
    """Where some runs stand among all those of a study."""

    before: int = 0  # runs that are over
    total: int | None = None  # runs of the study, at most; None where nobody knows, and nobody watches
    failed: int = 0  # of those before


class RunOptions(TypedDict, total=False):
    """How the runs of a study are made, by keyword. Their results depend on none of it."""

    jobs: int | None  # processes of joblib; one for each core if not given
    backend: str  # "joblib", or "dask"
    scheduler: str | None  # address of Dask's
    force: bool  # what another study left in the folder is thrown away
    watch: Watch


class Runner:
    """Makes runs in a folder, which it holds for as long as its context lasts."""

    def __init__(
        self,
        folder: Path,
        source: tuple[str, bytes],
        backend: Backend,
        *,
        force: bool = False,
        watch: Watch = no_progress,
    ):
        """`source` is the name of the study's own file in the folder, and what it holds.

        `force`: what another study left in the folder is thrown away. Raises InputError when the folder cannot be used.
        """
        backend.check()
        self.folder, self._backend, self._watch = folder, backend, watch
        self._over, self._total = 0, None  # of the study, as far as is known
        _prepare(folder, *source, force=force)
        self._journal = Journal(folder, packages())
        self._open = ExitStack()

    @classmethod
    def of(
        cls,
        folder: str | Path,
        source: tuple[str, bytes],
        *,
        jobs: int | None = None,
        backend: str = "joblib",
        scheduler: str | None = None,
        force: bool = False,
        watch: Watch = no_progress,
    ) -> Self:
        """Return the runner that `RunOptions` ask for. Raises InputError."""
        return cls(Path(folder), source, Backend(backend, jobs, scheduler), force=force, watch=watch)

    def __enter__(self) -> Self:
        """Lock the folder. Raises InputError when another study holds it, or other code made its runs."""
        self._open.enter_context(self._journal)
        remove_unfinished(self.folder, below=True)
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: TracebackType | None) -> None:
        """Unlock the folder. Raises Interrupted, which says what is in it, for Ctrl-C and the like."""
        self._open.close()
        if isinstance(error, KeyboardInterrupt):
            signal = error.signal if isinstance(error, Stopped) else SIGINT
            raise Interrupted(self._so_far(), signal) from None

    def run(
        self, tasks: Sequence[Task], logs: Sequence[str] = (), part: Part | None = None, ends: Ends | None = None
    ) -> list[tuple[Record, Record]]:
        """Return each task's record and timings; write its log under that name into `logs/`, if names are given.

        They are all runs of the study unless they are a `part`. The first task, in the order of `tasks`, whose record
        `ends` the study is the last one returned: what is under way then is ended, whichever runs came first.

        What ends this from outside leaves what is finished; the same call goes on from there.
        """
        names = dict(zip((task.digest for task in tasks), logs, strict=True)) if logs else {}
        left = {task.digest: task for task in tasks if not self._is_done(task, names)}
        if names:
            (self.folder / LOGS).mkdir(exist_ok=True)
        everything = len({task.digest for task in tasks})
        there = (self._journal[one][0] for one in {task.digest for task in tasks} - left.keys())
        part = part or Part(total=everything)
        failed = sum(record["status"] != "ok" for record in there)
        self._tell(part, everything - len(left), failed)
        if self._is_over(tasks, left, ends):
            return self._results(tasks, ends)
        with closing(self._backend.run(list(left.values()), bool(names))) as results:
            for result in results:
                self._keep(result, names)
                if result.thread_failure is not None:
                    take_thread_failure(result.thread_failure)
                del left[result.digest]
                failed += result.record["status"] != "ok"
                self._tell(part, everything - len(left), failed)
                if self._is_over(tasks, left, ends):
                    break
        return self._results(tasks, ends)

    def _is_over(self, tasks: Sequence[Task], left: Mapping[str, Task], ends: Ends | None) -> bool:
        """Return whether a run ends the study, and all before it are known, while others are left."""
        if ends is None:
            return False
        known = takewhile(lambda task: task.digest not in left, tasks)
        return bool(left) and any(ends(self._journal[task.digest][0]) for task in known)

    def _results(self, tasks: Sequence[Task], ends: Ends | None) -> list[tuple[Record, Record]]:
        results = []
        for task in tasks:
            results.append(self._journal[task.digest])
            if ends is not None and ends(results[-1][0]):
                break
        return results

    def _tell(self, part: Part, over: int, failed: int) -> None:
        self._over, self._total = part.before + over, part.total
        if self._total is not None:
            self._watch(self._over, self._total, part.failed + failed)

    def _so_far(self) -> str:
        over = counted(self._over, "run") if self._total is None else f"{self._over} of {counted(self._total, 'run')}"
        return f"{self.folder} has {over}; the same command continues from there"

    def _is_done(self, task: Task, names: dict[str, str]) -> bool:
        if task.digest not in self._journal:
            return False
        record, name = self._journal[task.digest][0], names.get(task.digest)
        return name is None or record["status"] != "ok" or (self.folder / LOGS / name).is_file()

    def _keep(self, result: Result, names: dict[str, str]) -> None:
        if result.versions != packages():
            changed = sorted(name for name, version in packages().items() if result.versions.get(name) != version)
            raise PbrgError(f"a worker has another {', '.join(changed)} than this machine; its runs are not taken")
        if result.log is not None:  # before the line that says it is there
            content = result.log
            write_atomically(self.folder / LOGS / names[result.digest], lambda path: _write(path, content))
        self._journal.add(result)


def _prepare(folder: Path, name: str, content: bytes, *, force: bool) -> None:
    """Make the folder and put the study's file into it. Raises InputError."""
    if folder.exists() and not folder.is_dir():
        raise InputError("this is not a folder", file=str(folder))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = (folder / name).read_bytes() if (folder / name).is_file() else None
    except OSError as error:
        raise write_error(error, "cannot be used", folder) from None
    if force:
        (folder / FILE).unlink(missing_ok=True)
    elif there is None and (folder / FILE).exists():
        raise InputError("holds the runs of another study; allowed: a new folder, or --force", file=str(folder))
    elif there is not None and there != content:
        raise InputError("is another one by now; allowed: a new folder, or --force", file=str(folder / name))
    if there != content:
        write_atomically(folder / name, lambda path: _write(path, content))


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
