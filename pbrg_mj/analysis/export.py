"""Time series for NumPy, MATLAB and pandas."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import savemat

from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.analysis.series import Series, series
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run

MAT_HEADER = b"MATLAB 5.0 MAT-file, pbrg-mj"
CSV_ROWS = 200  # written at a time
MAT_HEADER_LENGTH = 116  # free text at the start of a MAT-file


def export(run: Run, path: Path) -> None:
    """Write all time series of a run to `path`; .npz, .mat or .csv. Raises InputError for another suffix."""
    write = by_suffix(path, WRITERS)
    if not len(run.ticks.time):
        raise InputError("the log holds no complete tick", file=run.path)
    write_atomically(path, lambda whole: write(run, whole))


def arrays(run: Run) -> dict[str, np.ndarray]:
    """Return every series as an array by name and unit, with what is constant over the run."""
    constants = {
        "formation_m": np.array(run.scenario.team.formation),
        "leaders": np.array(run.scenario.team.leaders),
        "scenario_name": np.array(run.name),
        "scenario_yaml": np.array(run.scenario_yaml),
    }
    return {one.key: one.values for one in series(run)} | constants


def _write_npz(run: Run, path: Path) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays(run))  # pyright: ignore[reportArgumentType]


def _write_mat(run: Run, path: Path) -> None:
    buffer = io.BytesIO()
    savemat(buffer, arrays(run), do_compression=True, oned_as="column")
    # savemat puts the date into the free text; the same run shall give the same bytes.
    path.write_bytes(MAT_HEADER.ljust(MAT_HEADER_LENGTH) + buffer.getvalue()[MAT_HEADER_LENGTH:])


def _write_csv(run: Run, path: Path) -> None:
    """Write a row per tick. Numbers become texts some ticks at a time: as objects they take ten times the memory."""
    known = series(run)
    rows_of = {id(one.index): _rows_of(run, one) for one in known}
    columns = [(rows_of[id(one.index)], name, values) for one in known for name, values in one.columns()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([name for _, name, _ in columns])
        for first in range(0, len(run.ticks.index), CSV_ROWS):
            rows = range(first, min(first + CSV_ROWS, len(run.ticks.index)))
            writer.writerows(zip(*(_in_rows(where, values, rows) for where, _, values in columns), strict=True))


def _rows_of(run: Run, one: Series) -> np.ndarray:
    """Return the row of each entry of a series among the ticks, -1 for one whose tick is lost."""
    if one.index is run.ticks.index:
        return np.arange(len(one.index))
    rows = np.minimum(np.searchsorted(run.ticks.index, one.index), len(run.ticks.index) - 1)
    return np.where(run.ticks.index[rows] == one.index, rows, -1)


def _in_rows(where: np.ndarray, values: np.ndarray, rows: range) -> list[object]:
    """Return one entry per row of some, blank where the series has none."""
    column: list[object] = [""] * len(rows)
    there = np.flatnonzero((where >= rows.start) & (where < rows.stop))
    chosen = values[there]
    for row, value in zip(
        where[there].tolist(), (chosen.astype(int) if chosen.dtype == bool else chosen).tolist(), strict=True
    ):
        column[row - rows.start] = value
    return column


WRITERS: dict[str, Callable[[Run, Path], None]] = {".npz": _write_npz, ".mat": _write_mat, ".csv": _write_csv}
