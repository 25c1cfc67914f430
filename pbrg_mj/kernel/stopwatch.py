"""A wall clock for measuring speed, which stands still while kernels are compiled or read from the cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter

_spent = 0.0  # on compiling so far [s]
_depth = 0
_watchers: list[Callable[[str | None], None]] = []


def clock() -> float:
    """Return a time [s] whose differences are wall-clock time without that of compiling."""
    return perf_counter() - _spent


@contextmanager
def not_counted() -> Iterator[None]:
    """Stop the clock for as long as the context lasts; contexts may be nested."""
    global _spent, _depth
    began, _depth = perf_counter(), _depth + 1
    try:
        yield
    finally:
        _depth -= 1
        if not _depth:
            _spent += perf_counter() - began


@contextmanager
def watching_compilation(watcher: Callable[[str | None], None]) -> Iterator[None]:
    """Call `watcher` with a kernel's name before it is compiled and with None after, while the context lasts."""
    _watchers.append(watcher)
    try:
        yield
    finally:
        _watchers.remove(watcher)


def report(name: str | None) -> None:
    """Tell all watchers."""
    for watcher in _watchers:
        watcher(name)
