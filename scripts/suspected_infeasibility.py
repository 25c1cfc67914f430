"""How often robots suspect what the centralized solver finds infeasible, in whole bundled runs.

python scripts/suspected_infeasibility.py [NAME ...]    # the table of docs/failure-modes.md; some two minutes

A robot knows its own rows and what its neighbours send. Where the solver finds no admissible reference, the governor's
status says `suspected` or `capped`, or nothing. Counted are the ticks at which the solver was asked.
"""

from __future__ import annotations

import sys
from collections import Counter

import pbrg_mj as pbrg

RUNS = ("obstacles/doorway", "sensing/late_detection", "disturbances/carried_away", "network/slow_radio")
SAID = ("suspected", "capped")


def main() -> None:
    print(f"| run | reference ticks: infeasible / not | {' | '.join(f'`{word}` in' for word in SAID)} |")
    print("|---|---|" + "---|" * len(SAID))
    for name in sys.argv[1:] or RUNS:
        counted = count(pbrg.run(name))
        ticks = f"{counted[True, None]} / {counted[False, None]}"
        said = " | ".join(f"{counted[True, word]} / {counted[False, word]}" for word in SAID)
        print(f"| `{name}` | {ticks} | {said} |", flush=True)


def count(run: pbrg.Run) -> Counter[tuple[bool, str | None]]:
    """Return at how many reference ticks the problem was infeasible (True) or not, in all and by what was said."""
    counted: Counter[tuple[bool, str | None]] = Counter()
    for tick, found in zip(run.reference_tick, run.reference_status, strict=True):
        infeasible, said = str(found) == "infeasible", str(run.status[tick])
        counted[infeasible, None] += 1
        counted[infeasible, said] += 1
    return counted


if __name__ == "__main__":
    main()
