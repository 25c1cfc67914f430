"""Rows of two kinds of messages that belong to one tick, brought together while both are read."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pbrg_mj.log.read.column_store import Columns


class MissingRowError(LookupError):
    """A row whose partner was not kept."""


class IndexJoin:
    """Rows with the same `index`, from two tables that are given a block at a time, each in order.

    The columns of the rows of either table come as soon as both are there. Rows of the first table without a partner
    are left out; for one of the second, MissingRowError is raised if `complete`, else it is left out too.
    """

    def __init__(self, *, complete: bool):
        self._complete = complete
        self._first: Columns = {}
        self._second: Columns = {}
        self._reached = -1  # index of the last row of the first table

    def first(self, columns: Columns, reached: int) -> Iterator[tuple[Columns, Columns]]:
        """Take rows of the first table, which has been read up to the index `reached`, and yield what came together."""
        self._first, self._reached = _behind(self._first, columns), max(self._reached, reached)
        return self._match()

    def second(self, columns: Columns) -> Iterator[tuple[Columns, Columns]]:
        """Take rows of the second table, and yield what came together."""
        self._second = _behind(self._second, columns)
        return self._match()

    def _match(self) -> Iterator[tuple[Columns, Columns]]:
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
        yield {name: values[places[there]] for name, values in self._first.items()}, paired
        later = int(np.searchsorted(index, wanted[-1], side="right"))
        self._first = {name: values[later:] for name, values in self._first.items()}
        self._second = {name: values[~due] for name, values in self._second.items()}


def _behind(before: Columns, columns: Columns) -> Columns:
    return {name: np.concatenate([before[name], values]) if before else values for name, values in columns.items()}
