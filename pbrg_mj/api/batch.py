"""Many seeds of a scenario side by side, without logs."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.metrics.batch_metrics import WRITERS, arrays, batch_metrics, save_batch
from pbrg_mj.analysis.output_file import by_suffix
from pbrg_mj.api.arrays import Arrays
from pbrg_mj.api.scenario import Scenario, as_scenario
from pbrg_mj.kernel import clock
from pbrg_mj.log.write.log_file import check_writable
from pbrg_mj.loop.batch import BatchHistories, BatchSimulation


class Batch(Arrays):
    """W runs of T ticks as arrays by name.

    `seeds` (W,), `time_s` (T,), `hand_world_m` and `m_m` (W, T, n, 2), `wall_margin_m`, `wall_contact` and
    `robot_contact` (W, T, n), `diverged` (W, T).
    """

    def __init__(self, scenario: Scenario, histories: BatchHistories, speed: float):
        """Take over what happened, and how many simulated seconds passed in a second."""
        super().__init__(arrays(histories))
        self._scenario, self._histories, self._speed = scenario, histories, speed

    @property
    def scenario(self) -> Scenario:
        """The scenario of all runs, but for the seed."""
        return self._scenario

    def summary(self) -> dict[str, Any]:
        """Return what the runs have in common and where they differ, units in the names."""
        speed = {"simulated_s_per_s": self._speed}
        numbers = batch_metrics(self._histories, self._scenario.settings.outcome.contacts)
        return {"scenario": self._scenario.name, **numbers, **speed}

    @property
    def failed(self) -> bool:
        """Whether a robot touched a wall or another robot, or crossed a wall's line, or a state diverged, in any run.

        Contacts that the scenario allows (`outcome.contacts`) are left out.
        """
        numbers = self.summary()
        return bool(numbers["worlds_violated"] or numbers["worlds_diverged"])

    def save(self, path: str | Path) -> Path:
        """Write all arrays (.npz); return the path. Raises InputError."""
        save_batch(self._histories, Path(path))
        return Path(path)


def batch(
    scenario: Scenario | str | Path,
    seeds: Iterable[int] = range(1, 65),
    *,
    path: str | Path | None = None,
    force: bool = False,
    threads: int | None = None,
) -> Batch:
    """Run seeds of a scenario side by side on `threads` threads, one for each core if not given.

    Every one is bit for bit the run of its seed alone; what a run records besides its motion is left out. The arrays
    are written to `path` (.npz), if one is given; `force` allows to replace a file that exists.

    Raises InputError for what cannot be stepped side by side, such as a governor of another package.
    """
    scenario = as_scenario(scenario)
    if path is not None:  # before the runs, which take longer
        by_suffix(Path(path), WRITERS)
        check_writable(Path(path), force=force)
    worlds = BatchSimulation(scenario.settings, tuple(seeds), threads)
    began = clock()
    histories = worlds.run()
    simulated = len(histories.seeds) * float(histories.time[-1])
    made = Batch(scenario, histories, simulated / (clock() - began))
    if path is not None:
        made.save(path)
    return made
