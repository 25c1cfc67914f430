"""Where the runs of a study are made: in this process, in processes of this machine, or on the workers of Dask."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import tempfile
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from secrets import token_hex
from typing import Any, TypeVar

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.studies.run_task import Result, run_task, run_task_in_worker
from pbrg_mj.studies.task import Task

BACKENDS = ("joblib", "dask")
IDLE_TIMEOUT = 20  # [s] without work after which a process ends, also where the one that gave it work was killed
WARNINGS = "PYTHONWARNINGS"  # by which Python decides what to warn of, in a process that begins
EXPECTED = (
    ".*have been cancelled",  # as Ctrl-C means them to be
    "A worker stopped while some jobs",  # loky ends one that has grown by 300 MB, after its run, and starts another
)
SCHEDULER_TIMEOUT = 10.0  # [s] for a scheduler to answer
R = TypeVar("R")


@dataclass(frozen=True)
class Backend:
    """How runs are made. What they give does not depend on it."""

    name: str = "joblib"
    jobs: int | None = None  # processes of joblib; one for each core if not given
    scheduler: str | None = None  # address of Dask's

    def check(self) -> None:
        """Raise InputError for a backend or scheduler that is not there, or options that do not belong to it."""
        if self.name not in BACKENDS:
            raise InputError(f"is {self.name!r}; allowed: {', '.join(BACKENDS)}", key="backend")
        if self.name == "joblib" and self.scheduler is not None:
            raise InputError("is for the backend dask alone", key="scheduler")
        if self.name == "dask" and self.scheduler is None:
            raise InputError(
                "is missing; required with the backend dask: an address such as tcp://host:8786", key="scheduler"
            )
        if self.name == "dask" and find_spec("distributed") is None:
            raise InputError("the backend dask needs Dask: pip install distributed")
        if self.name == "dask":
            _reach(str(self.scheduler))

    def run(self, tasks: Sequence[Task], keep_logs: bool) -> Generator[Result, None, None]:
        """Yield the results in the order in which they come. Closing the iterator ends what is under way."""
        jobs = min(self.jobs or os.cpu_count() or 1, len(tasks))
        if self.name == "dask":
            return _dask(tasks, keep_logs, str(self.scheduler))
        return _processes(tasks, keep_logs, jobs) if jobs > 1 else _one_by_one(tasks, keep_logs)


def _one_by_one(tasks: Sequence[Task], keep_logs: bool) -> Generator[Result, None, None]:
    for task in tasks:
        yield run_task(task, keep_logs)


def _processes(tasks: Sequence[Task], keep_logs: bool, jobs: int) -> Generator[Result, None, None]:
    return in_processes(run_task_in_worker, [(task, keep_logs) for task in tasks], jobs)


def in_processes(
    function: Callable[..., R], arguments: Sequence[tuple[Any, ...]], jobs: int
) -> Generator[R, None, None]:
    """Yield what a function gives for each of the arguments, in the order in which they come.

    It is given what `become_worker` takes, too, by keyword: `parent` and `place`. Closing the iterator ends what is
    under way. Raises PbrgError when one of the processes is killed.
    """
    from joblib import Parallel, delayed
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    options: dict[str, Any] = {"batch_size": 1, "idle_worker_timeout": IDLE_TIMEOUT}
    pool = Parallel(n_jobs=jobs, backend="loky", return_as="generator_unordered", **options)
    one: Callable[..., Any] = delayed(function)
    # What killed processes leave behind goes with this folder. They make it, so that it never is without them.
    place = str(Path(tempfile.gettempdir()) / f"pbrg-{token_hex(8)}")
    finished = False
    try:
        with _hangup_blocked(), _warnings_ignored():
            made: Any = pool(one(*given, parent=os.getpid(), place=place) for given in arguments)
        with warnings.catch_warnings(), closing(made) as results:
            for expected in EXPECTED:
                warnings.filterwarnings("ignore", expected)
            yield from results
        finished = True
    except TerminatedWorkerError:
        raise PbrgError("a process that made runs was killed; the same command continues the study") from None
    finally:
        if not finished:
            get_reusable_executor().shutdown(wait=True, kill_workers=True)
        shutil.rmtree(place, ignore_errors=True)


@contextmanager
def _hangup_blocked() -> Iterator[None]:
    """Hold SIGHUP back: processes that are started meanwhile never get it, this one gets it afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _warnings_ignored() -> Iterator[None]:
    """Let processes that are started meanwhile print none of Python's warnings: this one has printed them."""
    before = os.environ.get(WARNINGS)
    os.environ[WARNINGS] = "ignore"
    try:
        yield
    finally:
        if before is None:
            del os.environ[WARNINGS]
        else:
            os.environ[WARNINGS] = before


def _dask(tasks: Sequence[Task], keep_logs: bool, scheduler: str) -> Generator[Result, None, None]:
    from distributed import Client, KilledWorker, as_completed

    with Client(scheduler, timeout=SCHEDULER_TIMEOUT) as client:
        futures = [
            client.submit(run_task_in_worker, task, keep_logs, pure=False, key=f"run-{task.digest}") for task in tasks
        ]
        waiting = as_completed(futures)
        try:
            for future in waiting:
                yield future.result()
                future.release()
        except KilledWorker as error:
            raise PbrgError(f"workers are killed again and again: {error}") from None
        finally:
            client.cancel(futures)


def _reach(scheduler: str) -> None:
    """Ask the scheduler who it is. Raises InputError when none answers: nobody, or what is no scheduler."""

    async def ask() -> Any:
        from distributed.core import rpc
        from distributed.security import Security

        secrets = Security().get_connection_args("client")  # of Dask's own configuration
        async with rpc(scheduler, timeout=SCHEDULER_TIMEOUT, connection_args=secrets) as there:
            return await there.identity()

    try:
        with ThreadPoolExecutor(1) as thread:  # a notebook's own thread has a loop already
            who = thread.submit(asyncio.run, asyncio.wait_for(ask(), SCHEDULER_TIMEOUT)).result()
    except Exception as error:  # of whatever kind: an address, a name or an answer may be wrong in many ways
        why = str(error) or type(error).__name__
        raise InputError(f"no scheduler answers at {scheduler!r}: {why}", key="scheduler") from None
    if who.get("type") != "Scheduler":
        raise InputError(f"at {scheduler!r} is a {who.get('type')} of Dask, no scheduler", key="scheduler")
