"""How a command that fails ends: one line on stderr, an exit code, and with --debug the traceback before it."""

from __future__ import annotations

import os
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from signal import SIGINT
from types import TracebackType
from typing import ParamSpec, TypeVar

import typer

from pbrg_mj.cli.console import StdoutClosedError, note, one_line
from pbrg_mj.errors import SHORTAGES, InputError, PbrgError, Stopped
from pbrg_mj.plugin_failures import failure_of_thread, forget_calls

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

FAILED, WRONG_INPUT, DEFECT, STDOUT_CLOSED = 1, 2, 3, 141  # the last one as after a signal
# typer has it only as the base of what it exports.
ClickError: type[Exception] = typer.BadParameter.__mro__[2]


def explain(error: BaseException, *, debug: bool) -> int:
    """Say in one line why a command ended, after the traceback if `debug`; return the exit code."""
    if isinstance(error, StdoutClosedError) or _is_stdout_closed(error):
        return STDOUT_CLOSED
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return _code_of(error)
    if debug:
        for line in traceback.format_exception(error):
            for text in line.splitlines():
                note(text)
    code, text = _verdict(error)
    note(f"error: {text}")
    return code


def signals_as_codes(command: Callable[Arguments, Result]) -> Callable[Arguments, Result | int]:
    """Return a command that returns 128 and the number of the signal that ends it: typer takes each for Ctrl-C."""

    @wraps(command)
    def ending(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result | int:
        try:
            return command(*arguments, **options)
        except KeyboardInterrupt as error:
            return _code_of(error)

    return ending


@contextmanager
def failures_on_one_line(*, debug: bool) -> Iterator[list[int]]:
    """Print failures of threads and destructors, and Python's warnings, a line each; give exit codes for threads'.

    Of threads that plug-ins start the first failure is printed: there may be one in every tick.
    """
    failed: list[int] = []
    hooks = threading.excepthook, sys.unraisablehook, warnings.showwarning

    def in_thread(hook: threading.ExceptHookArgs) -> None:
        if hook.exc_value is None:
            return
        of_plug_in = failure_of_thread(hook.exc_value)
        if of_plug_in is None or FAILED not in failed:
            explain(of_plug_in or hook.exc_value, debug=debug)
        failed.append(DEFECT if of_plug_in is None else FAILED)

    def unraisable(hook: sys.UnraisableHookArgs) -> None:
        if hook.exc_value is not None:
            explain(hook.exc_value, debug=debug)

    def warn(message: Warning | str, kind: type[Warning], file: str, line: int, *_: object) -> None:
        text = str(message)
        for one in text.splitlines() if debug and "\n" in text else ():
            note(one)
        note(f"warning: {one_line(text)}{f' ({file}:{line})' if debug else ''}")

    threading.excepthook, sys.unraisablehook, warnings.showwarning = in_thread, unraisable, warn  # type: ignore
    forget_calls()
    try:
        yield failed
    finally:
        threading.excepthook, sys.unraisablehook, warnings.showwarning = hooks


def _code_of(error: BaseException) -> int:
    return 128 + (error.signal if isinstance(error, Stopped) else SIGINT)


def _verdict(error: BaseException) -> tuple[int, str]:
    """Return the exit code, and what is wrong."""
    if isinstance(error, PbrgError):
        return (WRONG_INPUT if isinstance(error, InputError) else FAILED), str(error)
    if isinstance(error, ClickError):
        return WRONG_INPUT, f"{error.format_message()} See: pbrg --help"  # type: ignore[attr-defined]
    if isinstance(error, MemoryError):
        return FAILED, f"out of memory{_place(error.__traceback__)}: a smaller scenario, shorter run or log needs less"
    if isinstance(error, OSError) and (error.filename or error.errno in SHORTAGES):
        name = f"{os.fsdecode(error.filename)}: " if isinstance(error.filename, str | bytes) else ""
        return (FAILED if error.errno in SHORTAGES else WRONG_INPUT), f"{name}{error.strerror or error}"
    text = _text(error)
    message = f"{type(error).__name__}{': ' if text else ''}{text}{_place(error.__traceback__)}"
    return DEFECT, f"{message}; this is a defect of pbrg, `pbrg --debug` prints where"


def _text(error: BaseException) -> str:
    try:
        return one_line(str(error))
    except Exception:  # an exception of another package, whose text fails
        return ""


def _place(trace: TracebackType | None) -> str:
    """Return the innermost line of this package that it passed through."""
    frames = [frame for frame in traceback.extract_tb(trace) if "pbrg_mj" in Path(frame.filename).parts]
    return f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""


def _is_stdout_closed(error: BaseException) -> bool:
    """Return whether it is the exit by which the library for options answers a closed pipe, while it prints help."""
    return isinstance(error, SystemExit) and isinstance(error.__context__, BrokenPipeError)
