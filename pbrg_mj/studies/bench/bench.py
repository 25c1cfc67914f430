"""A benchmark: the suite's runs, and the table made from their records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.errors import InputError
from pbrg_mj.studies.bench.markdown import RUNS, as_markdown, runs_markdown, wall_clock_markdown
from pbrg_mj.studies.bench.page import page
from pbrg_mj.studies.bench.suite import Suite, copy_scenarios, read_suite
from pbrg_mj.studies.bench.table import BenchRun, Row, bench_runs, table
from pbrg_mj.studies.bench.text import as_text, wall_clock_text
from pbrg_mj.studies.records import rows, write_records
from pbrg_mj.studies.run_task import Record, packages
from pbrg_mj.studies.runner import Runner, RunOptions

FILES = {False: "suite.yaml", True: "quick_suite.yaml"}
"""The suite's file in a benchmark's folder; another name where it was run with `quick`."""
TABLE, WALL_CLOCK, PAGE = "table.md", "wall_clock.md", "index.html"


@dataclass(frozen=True)
class Bench:
    """A benchmark's table."""

    suite: Suite
    folder: Path
    runs: tuple[BenchRun, ...]

    @property
    def rows(self) -> list[Row]:
        """The rows: seeds, network and governor each."""
        return table(self.suite, self.runs)

    def table(self) -> str:
        """Return the table for a terminal."""
        return as_text(self.rows)

    def wall_clock(self) -> str:
        """Return the times by the wall clock for a terminal."""
        return wall_clock_text(self.rows)

    def markdown(self) -> str:
        """Return the table in Markdown, the same at every repetition."""
        return as_markdown(self.suite, self.rows)


def bench(
    suite: str | Path,
    folder: str | Path,
    *,
    quick: bool = False,
    **options: Unpack[RunOptions],
) -> Bench:
    """Run a suite, a bundled one's name or a file, and write its table, page, records and logs into `folder`.

    `table.md` is the same at every repetition; `runs.md` names each run's log and the command that makes it;
    `wall_clock.md` has the times, which no repetition makes again, and the page `index.html` all of it, with pictures.
    `quick` runs the suite's smaller one. Other arguments, resumption and errors are those of `sweep`.
    """
    read, folder = read_suite(suite, quick=quick), Path(folder)
    if (folder / FILES[not quick]).exists() and not options.get("force"):
        other = "another suite than the quick one" if quick else "the quick suite"
        raise InputError(f"has the runs of {other}; allowed: a new folder, or --force", file=str(folder))
    with Runner.of(folder, (FILES[quick], read.file.content), **options) as runner:
        copy_scenarios(read, folder)
        results = runner.run(read.tasks, read.logs)
        (folder / FILES[not quick]).unlink(missing_ok=True)
        return write(read, results, folder)


def write(suite: Suite, results: Sequence[tuple[Record, Record]], folder: Path) -> Bench:
    """Write the table, the page and the records of runs whose logs are in the folder."""
    made = Bench(suite, folder, tuple(bench_runs(suite, results)))
    write_records(folder, *rows(suite.tasks, results))
    texts = {
        TABLE: made.markdown(),
        WALL_CLOCK: wall_clock_markdown(made.rows),
        RUNS: runs_markdown(made.rows),
        PAGE: page(suite, made.rows, folder, packages()),
    }
    for name, text in texts.items():
        write_text_atomically(folder / name, text)
    return made
