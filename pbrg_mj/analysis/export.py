"""Time series for NumPy, MATLAB and pandas."""

from __future__ import annotations

import csv
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.io import savemat

from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.analysis.series import Series, series
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run

MAT_HEADER = b"MATLAB 5.0 MAT-file, pbrg-mj"
CSV_ROWS = 200  # written at a time
MAT_HEADER_LENGTH = 116  # free text at the start of a MAT-file, bytes
MAT_FLAGS_LENGTH = 12  # behind it
MAT_TAG = struct.Struct("=II")  # before every element: its type, and its length in bytes
MAT_COMPRESSED = 15  # the type of an element that holds another one, compressed
MAT_DOUBLES = 9  # the type of numbers
MAT_LENGTH_AT = 32  # where an array's element has the length of its first axis, behind tag, flags and a tag
MAT_BLOCK = 2**20  # bytes of an array that is written in columns


def export(run: Run, path: Path) -> None:
    """Write all time series of a run to `path`; .npz, .mat or .csv. Raises InputError for another suffix."""
    write = by_suffix(path, WRITERS)
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    write_atomically(path, lambda whole: write(run, whole))


class RunArrays(Mapping[str, np.ndarray]):
    """Every series of a run as an array by name and unit, made whenever it is asked for, and the run's constants."""

    def __init__(self, run: Run):
        self._series = {one.key: one for one in series(run)}
        self._constants = {
            "formation_m": np.array(run.scenario.team.formation),
            "leaders": np.array(run.scenario.team.leaders),
            "scenario_name": np.array(run.name),
            "scenario_yaml": np.array(run.scenario_yaml),
        }

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises KeyError."""
        return self._series[name].values if name in self._series else self._constants[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is an array of that name, which is not made."""
        return name in self._series or name in self._constants

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return chain(self._series, self._constants)

    def __len__(self) -> int:
        """Return how many arrays there are."""
        return len(self._series) + len(self._constants)


def _write_npz(run: Run, path: Path) -> None:
    """Write what `numpy.savez_compressed` would, an array at a time."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in RunArrays(run).items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, values, allow_pickle=False)


def _write_mat(run: Run, path: Path) -> None:
    """Write what `scipy.io.savemat` would with compression, an array at a time."""
    with path.open("wb") as file:
        for name, values in RunArrays(run).items():
            head, pieces = _mat_element(name, values)
            if not file.tell():
                # savemat puts the date into the free text; the same run shall give the same bytes.
                file.write(MAT_HEADER.ljust(MAT_HEADER_LENGTH) + head[MAT_HEADER_LENGTH:])
            _compress(pieces, file)


def _mat_element(name: str, values: np.ndarray) -> tuple[bytes, Iterable[bytes]]:
    """Return a MAT-file's header, and an array as its element, in pieces: those of a large one are columns.

    MATLAB has the first axis run fastest, so that savemat holds such an array three times.
    """
    large = values.dtype == np.float64 and values.ndim > 1 and values.nbytes > MAT_BLOCK
    plain = BytesIO()
    savemat(plain, {name: values[:1] if large else values}, oned_as="column")
    whole = plain.getvalue()
    head, element = whole[: MAT_HEADER_LENGTH + MAT_FLAGS_LENGTH], whole[MAT_HEADER_LENGTH + MAT_FLAGS_LENGTH :]
    if not large:
        return head, [element]
    before = element[: -values[:1].nbytes - MAT_TAG.size]  # all but the numbers and their tag
    kind, size = MAT_TAG.unpack_from(before)
    lines = bytearray(before)
    MAT_TAG.pack_into(lines, 0, kind, size - values[:1].nbytes + values.nbytes)
    struct.pack_into("=i", lines, MAT_LENGTH_AT, len(values))
    columns = (np.ascontiguousarray(values[(slice(None), *at[::-1])]) for at in np.ndindex(values.shape[:0:-1]))
    return head, chain([bytes(lines), MAT_TAG.pack(MAT_DOUBLES, values.nbytes)], (one.tobytes() for one in columns))


def _compress(pieces: Iterable[bytes], file: BinaryIO) -> None:
    """Write an array of a MAT-file, with its tag, as a compressed element."""
    start, compressor = file.tell(), zlib.compressobj()
    file.write(bytes(MAT_TAG.size))
    for piece in pieces:
        file.write(compressor.compress(piece))
    file.write(compressor.flush())
    end = file.tell()
    file.seek(start)
    file.write(MAT_TAG.pack(MAT_COMPRESSED, end - start - MAT_TAG.size))
    file.seek(end)


def _write_csv(run: Run, path: Path) -> None:
    """Write a row per tick. Numbers become texts some ticks at a time: as objects they take ten times the memory."""
    start = replace(run, ticks=run.ticks.rows(0, 1), optima=run.optima.rows(0, 1), timings=run.timings.rows(0, 1))
    names = [name for one in series(start) for name, _ in one.columns()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for first in range(0, len(run.ticks.index), CSV_ROWS):
            part = run.part(first, first + CSV_ROWS)
            rows, cells = len(part.ticks.index), {}
            for one in series(part):
                where = _rows_of(part, one)
                cells |= {name: _in_rows(where, values, rows) for name, values in one.columns()}
            writer.writerows(zip(*(cells.get(name, [""] * rows) for name in names), strict=True))


def _rows_of(run: Run, one: Series) -> np.ndarray:
    """Return the row of each entry of a series among the ticks, -1 for one whose tick is lost."""
    if one.index is run.ticks.index:
        return np.arange(len(one.index))
    rows = np.minimum(np.searchsorted(run.ticks.index, one.index), len(run.ticks.index) - 1)
    return np.where(run.ticks.index[rows] == one.index, rows, -1)


def _in_rows(where: np.ndarray, values: np.ndarray, rows: int) -> list[object]:
    """Return one entry per row, blank where the series has none."""
    column: list[object] = [""] * rows
    there = np.flatnonzero(where >= 0)
    chosen = values[there]
    for row, value in zip(
        where[there].tolist(), (chosen.astype(int) if chosen.dtype == bool else chosen).tolist(), strict=True
    ):
        column[row] = value
    return column


WRITERS: dict[str, Callable[[Run, Path], None]] = {".npz": _write_npz, ".mat": _write_mat, ".csv": _write_csv}
