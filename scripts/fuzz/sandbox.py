"""A command in a process of its own, with limits on time and memory."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import resource
import select
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

CPU = 20  # [s]
MEMORY = 2**30  # [bytes] resident, beyond what the parent has
WALL = 300  # [s] a process that sleeps uses no processor
LARGEST_FILE = 2**29  # [bytes]
ESCAPED = 70  # exit code of an exception that nobody caught


@dataclass(frozen=True)
class Ending:
    """How a command ended."""

    code: int | None  # None: a signal ended it
    signal: int | None
    cpu_s: float
    memory_bytes: int  # most resident, beyond what the parent had
    stdout: str
    stderr: str


def run_apart(command: Callable[[], int | None]) -> Ending:
    """Call `command` in a fork of this process, whose imports and compiled kernels it shares, and wait for its end."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        shared = anonymous_memory()
        child = os.fork()
        if not child:
            _run_child(command, out, err)
        status, usage = _wait(child)
        code = os.waitstatus_to_exitcode(status)
        return Ending(
            code=code if code >= 0 else None,
            signal=-code if code < 0 else None,
            cpu_s=usage.ru_utime + usage.ru_stime,
            memory_bytes=max(0, usage.ru_maxrss * 1024 - shared),
            stdout=_text(out),
            stderr=_text(err),
        )


def _run_child(command: Callable[[], int | None], out: BinaryIO, err: BinaryIO) -> None:
    """Run the command within its limits and end this process."""
    code: int | None = ESCAPED
    try:
        os.setsid()
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        faulthandler.enable(2)
        sys.stdout, sys.stderr = (open(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))  # noqa: SIM115
        limit(resource.RLIMIT_CPU, CPU)
        limit(resource.RLIMIT_FSIZE, LARGEST_FILE)
        limit(resource.RLIMIT_CORE, 0)
        limit(
            resource.RLIMIT_AS, mapped() + MEMORY + MEMORY // 2
        )  # maps more than is resident; the verdict counts that
        code = command()
    except SystemExit as ending:
        code = ending.code if isinstance(ending.code, int) else int(ending.code is not None)
    except BaseException:
        traceback.print_exc()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code or 0)


def limit(what: int, most: int) -> None:
    """Limit a resource of this process; where it is CPU time, a signal that no handler waits for ends it."""
    resource.setrlimit(what, (most, most + 1 if what == resource.RLIMIT_CPU else most))


def mapped() -> int:
    """Return the size of this process's address space [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def anonymous_memory() -> int:
    """Return what of this process is in memory and of no file [bytes]: what a fork has from its start."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon:")) * 1024


def _wait(child: int) -> tuple[int, resource.struct_rusage]:
    handle = os.pidfd_open(child)
    try:
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        if not poll.poll(WALL * 1000):
            os.kill(child, signal.SIGKILL)
    finally:
        os.close(handle)
    _, status, usage = os.wait4(child, 0)
    return status, usage


def _text(stream: BinaryIO) -> str:
    stream.seek(0)
    return stream.read(2**24).decode("utf-8", "replace")
