"""Records as one Parquet file: a row a run, the same bytes for the same runs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.output_file import write_atomically
from pbrg_mj.studies.run_task import Record, column_types
from pbrg_mj.studies.task import Task

RECORDS, TIMINGS = "records.parquet", "timings.parquet"


def rows(tasks: Sequence[Task], results: Sequence[tuple[Record, Record]]) -> tuple[list[Record], list[Record]]:
    """Return the rows of the two files: what each run is and what it gave, and its wall-clock times."""
    heads = [
        {"run": index, "scenario": task.source.name, "seed": task.seed, **task.labels}
        for index, task in enumerate(tasks)
    ]
    found = [head | record for head, (record, _) in zip(heads, results, strict=True)]
    return found, [{"run": index} | timings for index, (_, timings) in enumerate(results)]


def write_records(folder: Path, records: Sequence[Record], timings: Sequence[Record]) -> None:
    """Write both files. Raises InputError when they cannot be written."""
    kinds = {"run": int, "scenario": str, "seed": int, "status": str, "error": str, **column_types(timings=False)}
    _write(folder / RECORDS, records, kinds)
    _write(folder / TIMINGS, timings, {"run": int, **column_types(timings=True)})


def read_records(folder: Path) -> list[Record]:
    """Return the rows of a folder's records."""
    from pyarrow import parquet

    return parquet.read_table(folder / RECORDS).to_pylist()


def _write(path: Path, records: Sequence[Record], kinds: Mapping[str, type]) -> None:
    import pyarrow
    from pyarrow import parquet

    names = list(dict.fromkeys(name for record in records for name in record)) or list(kinds)
    labels = [name for name in names if name not in kinds]
    order = [*(name for name in list(kinds)[:3] if name in names), *labels]
    order += [name for name in kinds if name not in order]
    columns = {name: _column([record.get(name) for record in records], kinds.get(name)) for name in order}
    arrow = {bool: pyarrow.bool_(), int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
    table = pyarrow.table({name: pyarrow.array(values, arrow[kind]) for name, (values, kind) in columns.items()})
    write_atomically(path, lambda whole: parquet.write_table(table, whole, compression="zstd"))


def _column(values: list[Any], kind: type | None) -> tuple[list[Any], type]:
    """Return a column's values and their type: what is not known is the narrowest type that holds all of them."""
    if kind is None:
        there = {type(value) for value in values if value is not None}
        kind = there.pop() if len(there) == 1 else float if there == {int, float} else str
        kind = kind if kind in (bool, int, float) else str
    if kind is str:
        return [value if value is None or isinstance(value, str) else json.dumps(value) for value in values], str
    return [None if value is None else kind(value) for value in values], kind
