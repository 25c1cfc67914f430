"""Where a run's time goes, stage by stage: `pbrg run --profile`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pbrg_mj.kernel import clock

if TYPE_CHECKING:
    from pbrg_mj.loop.record import TickRecord


class Profile:
    """Adds up the stages of all ticks but the first, which opens files and loads kernels; the rest is `other`."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}
        self._ticks = -1
        self._begin = self._end = 0.0

    def __call__(self, record: TickRecord) -> None:
        """Take in one tick, after all timed sinks."""
        self._ticks += 1
        if self._ticks == 0:
            self._seconds.clear()
            self._begin = self._end = clock()
            return
        for stage, seconds in record.timings._asdict().items():
            self._add(stage, seconds)
        self._end = clock()

    def timed(self, name: str, sink: Callable[[TickRecord], None]) -> Callable[[TickRecord], None]:
        """Return the sink, with the time it takes counted as a stage."""

        def call(record: TickRecord) -> None:
            begin = clock()
            sink(record)
            self._add(name, clock() - begin)

        return call

    def per_tick(self) -> dict[str, float]:
        """Return the mean time of every stage a tick [us], `other` and `total` last."""
        total = self._end - self._begin
        stages = {**self._seconds, "other": max(total - sum(self._seconds.values()), 0.0), "total": total}
        return {name: seconds / max(self._ticks, 1) * 1e6 for name, seconds in stages.items()}

    def table(self) -> str:
        """Return the same as text, with shares."""
        stages = self.per_tick()
        total = stages["total"] or 1.0
        lines = [f"{name:<20}{spent:>9.1f}{100 * spent / total:>9.1f}" for name, spent in stages.items()]
        return "\n".join([f"{'stage':<20}{'us/tick':>9}{'%':>9}", *lines])

    def _add(self, name: str, seconds: float) -> None:
        self._seconds[name] = self._seconds.get(name, 0.0) + seconds
