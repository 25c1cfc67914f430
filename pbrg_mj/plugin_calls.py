"""Calls of parts of other packages: limited in time, with inputs they cannot change, and answers that are checked.

Whatever a part raises is put down to it in one line. This guards against mistakes; it is no sandbox.
"""

from __future__ import annotations

import dataclasses
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, NoReturn

import numpy as np

from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.kernel import clock
from pbrg_mj.plugin_failures import is_from_outside, note_call, raised, shown_text

LIMIT_KEY = "timing.plug_in_limit"
RETRY_PERIOD = 0.1  # [s] after which a part that swallowed its interruption is interrupted again
# dtype of an answer -> kinds of arrays that may be taken for it
KINDS = {np.dtype(float): "fiu", np.dtype(np.int64): "fiu", np.dtype(bool): "biu"}
LARGEST_COUNT = 2**53  # doubles and JSON hold it exactly


class _TimeLimitExceeded(BaseException):
    """No Exception: a part's own `except Exception` must not take it for one of its own."""


@contextmanager
def plug_in_errors(noun: str, name: str, where: str, limit: float | None = None) -> Iterator[None]:
    """Turn whatever a part raises, `sys.exit` included, into a PlugInError that names it.

    `limit` is the wall-clock time it may take [s]; None is no limit. Python code of the main thread is interrupted;
    a call of compiled code, and other threads, only when they come back. Ctrl-C passes, and so do InputErrors of what
    is built, by which a part refuses a scenario.
    """
    note_call(name, noun)
    try:
        with np.errstate(), _limited(limit) if limit is not None else nullcontext():
            yield
    except PlugInError:
        raise
    except _TimeLimitExceeded:
        message = f"{name}: the {noun} took more than {limit:g} s in {where}, the limit of {LIMIT_KEY}"
        raise PlugInError(message) from None
    except BaseException as error:
        if is_from_outside(error) or (isinstance(error, InputError) and where == "build"):
            raise
        raise raised(f"{name}: the {noun}", where, error) from error


def call_plug_in(noun: str, name: str, where: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of a part with its errors turned likewise, without a limit of its own."""
    try:
        return function(*arguments)
    except (PlugInError, _TimeLimitExceeded):
        raise
    except BaseException as error:
        if is_from_outside(error):
            raise
        raise raised(f"{name}: the {noun}", where, error) from error


def read_only_copy(value: Any) -> Any:
    """Return a copy whose arrays are read-only, of an array or of data classes and named tuples of them."""
    if isinstance(value, np.ndarray):
        copy = value.copy()
        copy.flags.writeable = False
        return copy
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return type(value)(*map(read_only_copy, value))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.replace(
            value, **{f.name: read_only_copy(getattr(value, f.name)) for f in dataclasses.fields(value)}
        )
    return value


class ReadOnlyCopies:
    """Read-only copies of values that stay the same object for many ticks, such as a network: each is made once."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[Any, Any]] = {}

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value's read-only copy; `name` tells one value from another."""
        last = self._last.get(name)
        if last is None or last[0] is not value:
            last = self._last[name] = (value, read_only_copy(value))
        return last[1]


def copied(whose: str, what: str, value: Any, shape: tuple[int, ...], kind: Any = float) -> np.ndarray:
    """Return a copy of an array that a part answered; `whose` is its name and noun, such as `mine: the governor`.

    Raises PlugInError for another shape, or values of another kind: complex numbers, texts, objects, masked arrays;
    for whole numbers also fractions, NaN and what is negative or larger than 2^53; for truth values all but 0 and 1.
    """
    kind = np.dtype(kind)
    try:
        array = np.array(value, order="C")
    except Exception as error:
        raise PlugInError(f"{whose}'s {what} is no array of {kind}: {shown_text(error)}") from None
    if array.dtype.kind not in KINDS[kind] or isinstance(value, np.ma.MaskedArray):
        raise PlugInError(f"{whose}'s {what} is no array of {kind}: it holds {shown_text(array.dtype)}")
    if array.shape != shape:
        raise PlugInError(f"{whose}'s {what} has shape {array.shape}, not {shape}")
    if kind == np.int64 and not np.all((array >= 0) & (array <= LARGEST_COUNT) & (array == np.floor(array))):
        _refuse(whose, what, array, "whole numbers from 0 on")
    if kind == np.bool_ and not np.all((array == 0) | (array == 1)):
        _refuse(whose, what, array, "true and false")
    with np.errstate(over="ignore"):  # of long doubles, to infinity
        return array.astype(kind)


def where_active(active: np.ndarray, array: np.ndarray) -> np.ndarray:
    """Return an array with 0 for what is not finite in slots that are not active; nothing says what stands there."""
    slots = active.reshape(active.shape + (1,) * (array.ndim - active.ndim))
    return np.where(slots | np.isfinite(array), array, 0.0)


def within(whose: str, what: str, array: np.ndarray, largest: float, *, least: float | None = None) -> None:
    """Raise PlugInError unless all numbers are finite, from `least` (None: from -largest) to `largest`."""
    if not np.isfinite(array).all():
        raise PlugInError(f"{whose}'s {what} is not finite")
    if least is not None and np.any(array < least):
        raise PlugInError(f"{whose}'s {what} is less than {least:g}")
    if np.any(np.abs(array) > largest):
        raise PlugInError(f"{whose}'s {what} is larger than {largest:g}")


def chosen(whose: str, what: str, value: Any, allowed: tuple[str, ...]) -> Any:
    """Return the text among those allowed. Raises PlugInError for another text, and for what only equals one."""
    if not isinstance(value, str) or str(value) not in allowed:
        raise PlugInError(f"{whose}'s {what} is {shown_text(repr(value))}; allowed: {', '.join(allowed)}")
    return str(value)


def _refuse(whose: str, what: str, array: np.ndarray, allowed: str) -> NoReturn:
    raise PlugInError(f"{whose}'s {what} is {shown_text(array.tolist())}; allowed: {allowed}")


@contextmanager
def _limited(limit: float) -> Iterator[None]:
    """Raise _TimeLimitExceeded in the code inside once it takes longer than `limit` [s], at the latest at its end."""
    began = clock()
    with _interrupted_after(limit) if _can_interrupt() else nullcontext():
        yield
    if clock() - began > limit:
        raise _TimeLimitExceeded


def _can_interrupt() -> bool:
    """Return whether timers can: in a program's main thread, not on Windows."""
    return threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")


@contextmanager
def _interrupted_after(limit: float) -> Iterator[None]:
    running = True

    def ring(_signal: int, _frame: object) -> None:
        if running:
            raise _TimeLimitExceeded

    handler = signal.signal(signal.SIGALRM, ring)
    others = signal.setitimer(signal.ITIMER_REAL, limit, RETRY_PERIOD)
    try:
        try:
            yield
        finally:
            running = False
    finally:
        signal.setitimer(signal.ITIMER_REAL, *others)
        signal.signal(signal.SIGALRM, handler)
