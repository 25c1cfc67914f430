"""Columns by name as attributes, of which a log's are read when they are first asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Self

import numpy as np

from pbrg_mj.log.read.column_store import Columns, ColumnStore

STORE = "_store"  # where a series that is read from a log has its columns


class LoggedSeries:
    """Columns by name. Those of a log are read when they are first asked for."""

    index: np.ndarray

    @classmethod
    def of(cls, columns: Mapping[str, np.ndarray]) -> Self:
        """Return a series that has these columns alone; asking for another one raises AttributeError."""
        made = object.__new__(cls)
        made.__dict__.update({STORE: columns} if isinstance(columns, ColumnStore) else columns)
        return made

    def rows(self, first: int, last: int | None = None) -> Self:
        """Return the rows from `first` to before `last`, by default the end; a log's are read, and not kept here."""
        last = len(self.index) if last is None else last
        store = self.__dict__.get(STORE)
        if store is None:
            return self.of({name: values[first:last] for name, values in vars(self).items()})
        return self.of({name: store.read(name, first, last) for name in self._names() if name in store})

    def without_cache(self) -> Self:
        """Return the same series, which holds nothing that can be read again."""
        return self.of(self.__dict__.get(STORE, vars(self)))

    def __getattr__(self, name: str) -> np.ndarray:
        """Read a column. Raises AttributeError when it is not there."""
        store = self.__dict__.get(STORE, {})
        if name not in store or name not in self._names():
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        values = self.__dict__[name] = store[name]
        return values

    def __getstate__(self) -> Columns:
        """Return all columns: a copy in another process has no such file."""
        return {name: getattr(self, name) for name in self._names() if hasattr(self, name)}

    @classmethod
    def _names(cls) -> Iterable[str]:
        return cls.__annotations__
