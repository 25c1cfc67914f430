"""What the scripts with a row for each sensor share: their command line, and a table in Markdown."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence


def print_table(
    description: str,
    columns: Sequence[str],
    rows_of: Callable[[str, int], Iterable[Sequence[str]]],
    seeds: int,
    sensors: Sequence[str],
    choices: Sequence[str] | None = None,
) -> None:
    """Print a table, each row when it is done.

    Args:
        description: Of the script, for `--help`.
        columns: Their names.
        rows_of: Gives the rows, each its cells, of a sensor and a number of seeds.
        seeds: How many there are unless `--seeds` says otherwise.
        sensors: Presets of beams, unless `--sensors` says otherwise.
        choices: What `--sensors` takes; any if None.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=seeds)
    parser.add_argument("--sensors", nargs="+", choices=choices, default=sensors)
    args = parser.parse_args()
    print(f"{line(columns)}\n|{'---|' * len(columns)}")
    for sensor in args.sensors:
        for cells in rows_of(sensor, args.seeds):
            print(line(cells), flush=True)


def line(cells: Sequence[str]) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(cells)} |"
