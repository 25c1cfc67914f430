"""A sweep: many runs of any keys, as one table of records."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from pbrg_mj.studies.document import read_study
from pbrg_mj.studies.records import RECORDS, rows, write_records
from pbrg_mj.studies.run_task import Record
from pbrg_mj.studies.runner import Runner, RunOptions
from pbrg_mj.studies.sweep_plan import SweepKeys, plan

FILE = "sweep.yaml"


@dataclass(frozen=True)
class Sweep:
    """The records of a sweep, one a run, in the order of its plan."""

    folder: Path
    records: tuple[Record, ...]

    @property
    def path(self) -> Path:
        """The Parquet file of the records."""
        return self.folder / RECORDS

    @property
    def failed(self) -> int:
        """How many runs failed: they have an `error` in place of metrics."""
        return sum(record["status"] != "ok" for record in self.records)

    def summary(self) -> dict[str, Any]:
        """Return how many runs there are, how many failed, and how the others ended."""
        outcomes = Counter(record["outcome"] for record in self.records if record["status"] == "ok")
        return {"runs": len(self.records), "failed": self.failed, "outcomes": dict(sorted(outcomes.items()))}

    def __iter__(self) -> Iterator[Record]:
        """Iterate over the records."""
        return iter(self.records)

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.records)


def sweep(
    file: str | Path,
    folder: str | Path,
    **options: Unpack[RunOptions],
) -> Sweep:
    """Make the runs that a sweep's YAML file lists, and write their records into `folder`.

    `records.parquet` has a row a run, the same bytes whatever backend, order and number of jobs; `timings.parquet`
    the wall-clock times; `sweep.yaml` is the file. Runs that are in the folder already are not made again.

    The `options` are those of all studies: `backend` is "joblib" (if not given), with `jobs` processes (one for each
    core), or "dask", with the address of its `scheduler`. `force` throws away what another study left in the folder.
    `watch` is called with the numbers of runs that are over, of all, and of those that failed. A script that asks for
    several processes keeps what it does under `if __name__ == "__main__"`.

    A run that fails is a record with `status: failed` and its `error`. Ctrl-C raises Interrupted; the same call goes on
    from there. Raises InputError.
    """
    read = read_study(file, SweepKeys)
    tasks = plan(read)
    with Runner.of(folder, (FILE, read.content), **options) as runner:
        results = runner.run(tasks, log_names(len(tasks)) if read.keys.logs else ())
        records, timings = rows(tasks, results)
        write_records(Path(folder), records, timings)
    return Sweep(Path(folder), tuple(records))


def log_names(count: int) -> list[str]:
    """Return the names of the runs' logs: their numbers in the records, with as many digits as the last one has."""
    digits = len(str(count - 1))
    return [f"{index:0{digits}}.mcap" for index in range(count)]
