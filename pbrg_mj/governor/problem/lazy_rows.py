"""Lazy rows: made when they are first read, since nobody may ask for them.

Rows of the state are others at every tick. The certified governor decides without them, so only what reads them, the
monitor, the log and the centralized reference, has them made, beside the closed loop.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from pbrg_mj.governor.problem.rows import Rows

T = TypeVar("T")


class LazyRows(NamedTuple):
    """How rows are made, and the shape (n, R) that they will have."""

    make: Callable[[], Rows]
    shape: tuple[int, int]


class _LazyRowsField:
    """A field that is given `Rows` or `LazyRows`, and read as `Rows`."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __set__(self, whose: Any, given: Rows | LazyRows) -> None:
        whose.__dict__[self._name] = given

    def __get__(self, whose: Any, owner: type) -> Any:
        if whose is None:
            return self
        rows = whose.__dict__[self._name]
        if isinstance(rows, LazyRows):
            rows = whose.__dict__[self._name] = rows.make()
        return rows


def lazy_rows(name: str) -> Callable[[type[T]], type[T]]:
    """Return a decorator of dataclasses whose field of this name may be given `LazyRows`."""

    def decorated(found: type[T]) -> type[T]:
        setattr(found, name, _LazyRowsField(name))
        return found

    return decorated
