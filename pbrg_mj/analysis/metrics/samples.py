"""Numbers of which a mean, percentiles and the last ones are wanted, in memory that does not grow with them."""

from __future__ import annotations

import math
import tempfile
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

MOST_HELD = 2**16  # numbers in memory; more of them are in a temporary file
DIGIT, DIGITS = 2**16, 4  # a double's bits as a number of four digits


@dataclass(frozen=True)
class Statistics:
    """A quantity over time, in the unit its owner's name carries; NaN where there is no sample."""

    mean: float
    p95: float
    final: float


@dataclass(frozen=True)
class WallClock:
    """Wall-clock time per call, in the unit its owner's name carries; NaN without timings."""

    median: float
    p95: float


class Samples:
    """Numbers that are given a block at a time. Percentiles are exact: those of `numpy.percentile`."""

    def __init__(self) -> None:
        self._held: list[np.ndarray] = []
        self._file: BinaryIO | None = None
        self._count, self._sum, self._final = 0, 0.0, math.nan

    def add(self, values: np.ndarray) -> None:
        """Take rows of values, (S,) or (S, n)."""
        if not values.size:
            return
        self._held.append(np.array(values, dtype=float).ravel())
        self._count += values.size
        self._sum += float(np.sum(values))
        self._final = float(np.max(values[-1]))
        if sum(map(len, self._held)) > MOST_HELD:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as this exists
                weakref.finalize(self, self._file.close)
            self._file.seek(0, 2)
            for block in self._held:
                self._file.write(block.tobytes())
            self._held.clear()

    def statistics(self) -> Statistics:
        """Return mean and 95th percentile of all, and the largest of the last row; NaN of none."""
        mean = self._sum / self._count if self._count else math.nan
        return Statistics(mean, self.percentile(95), self._final)

    @np.errstate(invalid="ignore")  # between infinities
    def percentile(self, percent: float) -> float:
        """Return the percentile, linear between two numbers; NaN of none, and if one is NaN."""
        if not self._count:
            return math.nan
        if self._file is None:
            return float(np.percentile(np.concatenate(self._held), percent))
        if any(np.isnan(block).any() for block in self._blocks()):
            return math.nan
        place = (self._count - 1) * (percent / 100.0)
        low = math.floor(place)
        pair = [self._ordered(rank) for rank in (low, min(low + 1, self._count - 1))]
        return float(np.quantile(pair, place - low))

    def _ordered(self, rank: int) -> float:
        """Return the number of that rank, 0 the least: its digits one by one, each from a count of all."""
        known, bits = 0, 64
        for _ in range(DIGITS):
            bits -= 16
            counts = np.zeros(DIGIT, dtype=np.int64)
            for block in self._blocks():
                keys = _keys(block)
                alike = keys[keys >> np.uint64(bits + 16) == known] if bits < 48 else keys
                counts += np.bincount((alike >> np.uint64(bits)).astype(np.int64) % DIGIT, minlength=DIGIT)
            passed = np.cumsum(counts)
            digit = int(np.searchsorted(passed, rank, side="right"))
            rank -= int(passed[digit - 1]) if digit else 0
            known = known * DIGIT + digit
        return _number(known)

    def _blocks(self) -> Iterator[np.ndarray]:
        if self._file is not None:
            self._file.seek(0)
            while content := self._file.read(8 * MOST_HELD):
                yield np.frombuffer(content)
        yield from self._held


def _keys(values: np.ndarray) -> np.ndarray:
    """Return whole numbers in the order of the doubles: their bits, of negative ones inverted."""
    bits = values.view(np.uint64)
    return np.where(bits >> np.uint64(63), ~bits, bits | np.uint64(2**63))


def _number(key: int) -> float:
    bits = key - 2**63 if key >= 2**63 else 2**64 - 1 - key
    return float(np.array([bits], dtype=np.uint64).view(float)[0])


def statistics(values: np.ndarray) -> Statistics:
    """Return mean and 95th percentile of values (S,) or (S, n), and the largest of the last row."""
    samples = Samples()
    samples.add(values)
    return samples.statistics()
