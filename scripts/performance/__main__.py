"""Measure the speed of everything in docs/performance.md.

scripts/perf [--json] [--page]    # --page writes the tables into docs/performance.md

Ratios come from turns within this process, so a busy machine does little to them; the times need a quiet one.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from performance.batch import batch_throughput
from performance.closed_loop import closed_loop
from performance.page import tables, write_page
from performance.perception import perception
from performance.rounds import round_times
from performance.scale import round_of_a_thousand_robots, team_speeds
from performance.solvers import round_peers, solvers
from performance.start_up import memory_growth, starts


def measured() -> dict:
    """Return every figure, seconds in s unless the name says otherwise."""
    centralized, clarabel = solvers()
    return {
        "closed_loop": closed_loop(),
        "rounds": [asdict(one) for one in round_times()],
        "centralized": {**asdict(centralized), "clarabel_call": clarabel},
        "hundred_rounds": asdict(round_peers()),
        "perception": perception(),
        "worlds": batch_throughput(),
        "teams": [asdict(one) for one in team_speeds()],
        "round_of_a_thousand_s": round_of_a_thousand_robots(),
        "starts": starts(),
        "memory": memory_growth(),
    }


def main() -> None:
    """Measure, print, and write the page if wanted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print JSON in place of tables")
    parser.add_argument("--page", action="store_true", help="write the tables into docs/performance.md")
    chosen = parser.parse_args()
    figures = measured()
    if chosen.page:
        write_page(Path(__file__).parents[2] / "docs" / "performance.md", figures)
    sys.stdout.write((json.dumps(figures, indent=2) if chosen.json else tables(figures)) + "\n")


if __name__ == "__main__":
    main()
