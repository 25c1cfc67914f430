"""Timing that survives a busy machine: what is compared takes turns, and medians count."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median
from time import perf_counter

REPEATS = 9


def seconds(work: Callable[[], object]) -> float:
    """Return how long `work` took [s]."""
    begin = perf_counter()
    work()
    return perf_counter() - begin


def each_in_turn(works: Sequence[Callable[[], object]], calls: int, repeats: int = REPEATS) -> list[float]:
    """Return the median time of one call of each work [s], from `repeats` turns of `calls` calls, after a warm-up."""
    for work in works:
        work()

    def turn(work: Callable[[], object]) -> float:
        return seconds(lambda: [work() for _ in range(calls)]) / calls

    turns = [[turn(work) for work in works] for _ in range(repeats)]
    return [median(column) for column in zip(*turns, strict=True)]
