"""Rows of two kinds of messages that belong to one tick, brought together while both are read."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pbrg_mj.log.read.column_store import Columns


class MissingRowError(LookupError):
    """A row whose partner was not kept."""


class IndexJoin:
    """Rows with the same `index`, from two tables that are given a block at a time, each in order.

    `take` is given the columns of the rows of either table, as soon as both are there. Rows of the first table without
    a partner are left out; for one of the second, MissingRowError is raised if `complete`, else it is left out too.
    """

    def __init__(self, take: Callable[[Columns, Columns], None], *, complete: bool):
        self._take, self._complete = take, complete
        self._first: Columns = {}
        self._second: Columns = {}
        self._reached = -1  # index of the last row of the first table

    def first(self, columns: Columns, reached: int) -> None:
        """Take rows of the first table, which has been read up to the index `reached`."""
        self._first, self._reached = _behind(self._first, columns), max(self._reached, reached)
        self._match()

    def second(self, columns: Columns) -> None:
        """Take rows of the second table."""
        self._second = _behind(self._second, columns)
        self._match()

    def _match(self) -> None:
        if not self._second or not self._first:
            return
        due = self._second["index"] <= self._reached
        index, wanted = self._first["index"], self._second["index"][due]
        if not len(wanted):
            return
        places = np.minimum(np.searchsorted(index, wanted), max(len(index) - 1, 0))
        there = index[places] == wanted if len(index) else np.zeros(len(wanted), dtype=bool)
        if self._complete and not there.all():
            raise MissingRowError
        paired = {name: values[due][there] for name, values in self._second.items()}
        self._take({name: values[places[there]] for name, values in self._first.items()}, paired)
        later = int(np.searchsorted(index, wanted[-1], side="right"))
        self._first = {name: values[later:] for name, values in self._first.items()}
        self._second = {name: values[~due] for name, values in self._second.items()}


def _behind(before: Columns, columns: Columns) -> Columns:
    return {name: np.concatenate([before[name], values]) if before else values for name, values in columns.items()}
