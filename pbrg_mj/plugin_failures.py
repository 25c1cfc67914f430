"""Whose failure it is: of a part of another package, of one of its threads, or of nobody, as Ctrl-C is.

Imports no array library: the command line's start needs it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from traceback import walk_tb

from pbrg_mj.errors import PlugInError, Stopped

LONGEST = 300  # characters of a text shown
# Packages whose threads are our own; what fails in any other thread beside plug-ins is put down to them.
OWN_THREADS = {"pbrg_mj", "websockets", "joblib", "distributed", "tornado"}


class ThreadFailure(PlugInError):
    """What a thread of a part raised in another process, which told this one."""


_called: dict[str, str] = {}  # name -> noun of the parts called since `forget_calls`


def note_call(name: str, noun: str) -> None:
    """Take down that a part is called: from now on it may have threads."""
    _called[name] = noun


def forget_calls() -> None:
    """Forget which parts were called: no thread's failure is put down to them any more."""
    _called.clear()


def failure_of_thread(error: BaseException) -> PlugInError | None:
    """Return what to say of an error that ended a thread, where the thread is none of our own and parts were called.

    Which of several parts started it cannot be told: all are named.
    """
    if isinstance(error, ThreadFailure):
        return error
    packages = [frame.f_globals.get("__name__", "").partition(".")[0] for frame, _ in walk_tb(error.__traceback__)]
    began = next((package for package in packages if package != "threading"), "")
    if not _called or began in OWN_THREADS:
        return None
    whose = ", or ".join(f"{name}: the {noun}" for name, noun in _called.items())
    failure = raised(whose, "a thread of its own", error)
    failure.__cause__ = error
    return failure


def tell_thread_failures(tell: Callable[[str], object]) -> None:
    """Let this process, which works for another one, `tell` what threads of parts raise, a line each.

    All else goes to the hook that was there, and so does what another process told: it has been told.
    """
    before = threading.excepthook

    def in_thread(hook: threading.ExceptHookArgs) -> None:
        error = hook.exc_value
        failure = None if error is None or isinstance(error, ThreadFailure) else failure_of_thread(error)
        if failure is None:
            before(hook)
        else:
            tell(str(failure))

    threading.excepthook = in_thread


def take_thread_failure(text: str) -> None:
    """Treat what another process told as a failure of a thread of this one."""
    failure = ThreadFailure(text)
    threading.excepthook(threading.ExceptHookArgs((type(failure), failure, None, None)))


def raised(whose: str, where: str, error: BaseException) -> PlugInError:
    """Return that a part, `whose` name and noun are such as `mine: the governor`, raised an error."""
    return PlugInError(f"{whose} raised {type(error).__name__} in {where}: {shown_text(error)}")


def is_from_outside(error: BaseException) -> bool:
    """Return whether an error is Ctrl-C or another signal, and no KeyboardInterrupt that the part raised itself.

    Handlers of this package raise Stopped, and signals reach no thread but the main one.
    """
    if not isinstance(error, KeyboardInterrupt) or isinstance(error, Stopped):
        return isinstance(error, Stopped)
    handler = signal.getsignal(signal.SIGINT)
    ours = str(getattr(handler, "__module__", "")).startswith("pbrg_mj.")
    return callable(handler) and not ours and threading.current_thread() is threading.main_thread()


def shown_text(value: object) -> str:
    """Return a value's text in one line, cut when long; nothing if it has none."""
    try:
        text = " ".join(str(value).split())
    except Exception:
        return ""
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
