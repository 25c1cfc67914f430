"""What perception makes of single scans of real buildings, from a log in the CARMEN format.

python -m scripts.real_scans LOG... [--scans 20] [--unexplained 0.15]     # LOG may be gzipped; prints tables

- Known: the share of echoes that are on or behind something that one scan makes known, by points (echoes that bind) and
  by lines.
- Polylines: the echoes that are joined, as polylines of a number of vertices in all. An echo is explained when its beam
  meets a polyline; the error is the measured range less the range to there. After A. Schaefer et al., "A Maximum
  Likelihood Approach to Extract Polylines from 2-D Laser Range Scans", IROS 2018, whose figures stand beside ours.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from scripts.real_scans.carmen import read_carmen
from scripts.real_scans.measure import measure, table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG")
    parser.add_argument("--scans", type=int, default=20, help="of each log")
    parser.add_argument("--unexplained", type=float, default=0.15, help="error that an echo left out counts as [m]")
    args = parser.parse_args()
    print(table([row for path in args.logs for row in measure(read_carmen(path), args.scans, args.unexplained)]))


if __name__ == "__main__":
    main()
