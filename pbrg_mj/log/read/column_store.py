"""Columns that grow: in memory while they are small, else in a temporary file, from which they are read by name."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

Columns = dict[str, np.ndarray]
MOST_HELD = 2**21  # bytes in memory; more of them are in a temporary file


@dataclass(frozen=True)
class _Stored:
    """Rows of one column in the file."""

    offset: int  # bytes
    dtype: np.dtype

    def read(self, file: int, first: int, last: int, shape: tuple[int, ...]) -> np.ndarray:
        """Return the rows from `first` to before `last`. Raises OSError when the file does not have them."""
        row = self.dtype.itemsize * int(np.prod(shape))
        content = os.pread(file, (last - first) * row, self.offset + first * row)
        if len(content) != (last - first) * row:
            raise OSError("a temporary file was cut")
        return np.ndarray((last - first, *shape), self.dtype, content)


class ColumnStore(Mapping[str, np.ndarray]):
    """Columns by name, each read anew when it is asked for: the caller's own array."""

    def __init__(self) -> None:
        self.rows = 0
        self._kinds: dict[str, tuple[np.dtype, tuple[int, ...]]] = {}  # a column's type and the shape of its rows
        self._parts: list[tuple[int, dict[str, _Stored]]] = []  # number of rows, where they are
        self._held: list[Columns] = []
        self._file: BinaryIO | None = None

    def append(self, columns: Columns) -> None:
        """Put rows behind those that are here; always the same columns."""
        count = len(next(iter(columns.values()), ()))
        for name, values in columns.items():
            dtype, _ = self._kinds.get(name, (values.dtype, ()))
            longest = values.dtype if values.dtype.itemsize > dtype.itemsize else dtype  # of texts
            self._kinds[name] = (longest, values.shape[1:])
        self._held.append(columns)
        self.rows += count
        if sum(values.nbytes for one in self._held for values in one.values()) > MOST_HELD:
            self._store()

    def read(self, name: str, first: int, last: int) -> np.ndarray:
        """Return a column's rows from `first` to before `last`, as far as there are such. Raises KeyError, OSError."""
        dtype, shape = self._kinds[name]
        last = min(last, self.rows)
        values, start = np.empty((max(last - first, 0), *shape), dtype), 0
        for count, there in [*self._parts, *((len(one[name]), one) for one in self._held)]:
            low, high = max(first - start, 0), min(last - start, count)
            if low < high:
                values[start + low - first : start + high - first] = self._rows(there[name], low, high, shape)
            start += count
        return values

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a whole column. Raises KeyError, OSError."""
        return self.read(name, 0, self.rows)

    def __contains__(self, name: object) -> bool:
        """Tell whether there is such a column, which is not read."""
        return name in self._kinds

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._kinds)

    def __len__(self) -> int:
        """Return how many columns there are."""
        return len(self._kinds)

    def _rows(self, there: _Stored | np.ndarray, low: int, high: int, shape: tuple[int, ...]) -> np.ndarray:
        if isinstance(there, np.ndarray):
            return there[low:high]
        assert self._file is not None
        return there.read(self._file.fileno(), low, high, shape)

    def _store(self) -> None:
        """Put what is in memory into the file."""
        if self._file is None:
            self._file = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as this exists
            weakref.finalize(self, self._file.close)
        count, places = sum(len(next(iter(one.values()))) for one in self._held), {}
        for name in self._kinds:
            places[name] = _Stored(self._file.tell(), (values := np.concatenate([b[name] for b in self._held])).dtype)
            self._file.write(values.tobytes())
        self._file.flush()
        self._parts.append((count, places))
        self._held.clear()
