"""Scans from a log in the CARMEN format."""

from __future__ import annotations

import gzip
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

LIMITS = (8.0, 50.0, 81.9)  # [m] what these scanners report for no echo


class Log(NamedTuple):
    """Scans over half a turn, from right to left."""

    ranges: np.ndarray  # (scans, beams) [m], NaN for no echo
    angles: np.ndarray  # (beams,) from straight ahead [rad]


def read_carmen(path: Path) -> Log:
    """Return the scans of the front laser. Raises ValueError for a log without any, or with scans of several sizes."""
    with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as lines:
        scans = [_ranges(line.split()) for line in lines if line.startswith("FLASER ")]
    if not scans or len({len(scan) for scan in scans}) > 1:
        raise ValueError(f"{path} has no FLASER lines, or scans of several sizes")
    ranges = np.array(scans)
    limit = next((one for one in LIMITS if np.nanmax(ranges) < one + 1.0), math.inf)
    ranges[(ranges >= limit - 0.2) | (ranges <= 0.0)] = np.nan
    step = math.pi / (len(ranges[0]) - len(ranges[0]) % 2)  # 180 or 181 beams are one degree apart
    return Log(ranges, -math.pi / 2 + step * np.arange(len(ranges[0])))


def _ranges(words: list[str]) -> list[float]:
    count = int(words[1])
    return [float(word) for word in words[2 : 2 + count]]
