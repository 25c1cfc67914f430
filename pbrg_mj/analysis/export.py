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
    names, columns = zip(*((name, column) for one in series(run) for name, column in _in_rows(run, one)), strict=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(zip(*columns, strict=True))


def _in_rows(run: Run, one: Series) -> list[tuple[str, list[object]]]:
    """Return the columns with one entry per tick; blank where the series has none."""
    rows = {int(index): row for row, index in enumerate(run.ticks.index)}
    places = [(source, rows[int(index)]) for source, index in enumerate(one.index) if int(index) in rows]
    columns = []
    for name, values in one.columns():
        column: list[object] = [""] * len(rows)
        listed = (values.astype(int) if values.dtype == bool else values).tolist()
        for source, row in places:
            column[row] = listed[source]
        columns.append((name, column))
    return columns


WRITERS: dict[str, Callable[[Run, Path], None]] = {".npz": _write_npz, ".mat": _write_mat, ".csv": _write_csv}
