"""Many seeds of a scenario, or many worlds of a family, without logs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.batch_metrics import arrays, batch_metrics, save_arrays
from pbrg_mj.analysis.metrics.world_metrics import WorldMetrics, columns, summary, world_metrics
from pbrg_mj.api.arrays import Arrays
from pbrg_mj.api.files import check_arrays
from pbrg_mj.api.scenario import Scenario, as_scenario
from pbrg_mj.errors import InputError
from pbrg_mj.kernel import clock
from pbrg_mj.loop.batch import BatchSimulation, side_by_side
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.loop.resources import check_memory
from pbrg_mj.loop.sequential import run_worlds
from pbrg_mj.plugins import is_centralized


class Batch(Arrays):
    """W runs as arrays by name.

    One number a run, (W,): `seeds`, `robots`, `least_margin_m`, `final_distance_m` (largest ||q_j - b_j - r|| at the
    end) and the flags `world_violated`, `world_touching`, `world_touching_moving`,
    `world_touching_moving_avoidably`, `world_touching_robots`, `world_past_a_wall`,
    `world_past_a_moving_box`, `world_diverged`.

    Of seeds of one scenario also what happened at T ticks: `time_s` (T,), `hand_world_m` and `m_m` (W, T, n, 2),
    `wall_margin_m`, `moving_margin_m`, `wall_contact`, `moving_contact` and `robot_contact` (W, T, n), `diverged`
    (W, T). Worlds of a family differ in their numbers of robots and ticks: theirs is not kept.
    """

    def __init__(self, scenario: Scenario, arrays: Mapping[str, np.ndarray], summary: Mapping[str, Any]):
        """Take over what happened, and its summary."""
        super().__init__(arrays)
        self._scenario, self._summary = scenario, summary

    @property
    def scenario(self) -> Scenario:
        """The scenario of all runs but for the seed; of a family any of its worlds."""
        return self._scenario

    def summary(self) -> dict[str, Any]:
        """Return what the runs have in common and where they differ, units in the names.

        `rates` has, for every fate, the share of worlds that met it, and Wilson's 95 % interval of its probability.
        """
        kind = self._scenario.settings.governor.kind
        return {"scenario": self._scenario.name, "governor": kind, "centralized": is_centralized(kind), **self._summary}

    @property
    def failed(self) -> bool:
        """Whether a robot touched anything or crossed a line, or a state diverged, in any run.

        Contacts that the scenario allows (`outcome.contacts`) are left out.
        """
        return bool(self._summary["worlds_violated"] or self._summary["worlds_diverged"])

    def save(self, path: str | Path) -> Path:
        """Write all arrays (.npz); return the path. Raises InputError."""
        save_arrays(self, Path(path))
        return Path(path)


def batch(
    scenario: Scenario | str | Path,
    seeds: Iterable[int] = range(1, 65),
    *,
    path: str | Path | None = None,
    force: bool = False,
    threads: int | None = None,
) -> Batch:
    """Run seeds of a scenario, each bit for bit the run of its seed alone; of a family, the worlds of these seeds.

    What a run records besides its motion is left out. The arrays are written to `path` (.npz), if one is given; `force`
    allows to replace a file that exists.

    Seeds of one scenario are stepped side by side on `threads` threads, one for each core if not given. Worlds of a
    family, and scenarios with moving boxes, patches, a speed loop, a radio, kidnappings, or another governor than the
    plain distributed one and the certified one by prediction, run one after the other, or on `threads` processes: a
    script that asks for several keeps what it does under `if __name__ == "__main__"`. Raises InputError.
    """
    scenario, seeds = as_scenario(scenario), tuple(seeds)
    if path is not None:  # before the runs, which take longer
        check_arrays(path, force=force)
    if not seeds:
        raise InputError("no seeds are given; at least one is needed", key="seeds")
    began = clock()
    if scenario.family_yaml is not None:
        worlds = _family(scenario, seeds, threads)
        kept, figures = columns(worlds), summary(worlds)
    else:
        histories, began = _histories(scenario, seeds, threads)
        worlds = world_metrics(histories, scenario.settings)
        kept = {**arrays(histories), **columns(worlds)}
        figures = batch_metrics(histories, scenario.settings)
    speed = {"simulated_s_per_s": sum(world.simulated_s for world in worlds) / (clock() - began)}
    made = Batch(scenario, kept, figures | speed)
    if path is not None:
        made.save(path)
    return made


def _family(scenario: Scenario, seeds: tuple[int, ...], threads: int | None) -> list[WorldMetrics]:
    drawn = [scenario.override(seed=seed).settings for seed in seeds]
    run = zip(drawn, run_worlds(drawn, threads or 1), strict=True)
    return [figures for one, histories in run for figures in world_metrics(histories, one)]


def _histories(scenario: Scenario, seeds: tuple[int, ...], threads: int | None) -> tuple[BatchHistories, float]:
    """Return what happened, and when it began."""
    settings = scenario.settings
    if side_by_side(settings):
        simulation = BatchSimulation(settings, seeds, threads)
        began = clock()
        return simulation.run(), began
    check_memory(settings, len(seeds))
    began = clock()
    many = list(run_worlds([settings.model_copy(update={"seed": seed}) for seed in seeds], threads or 1))
    stacked = {
        field.name: np.concatenate([getattr(one, field.name) for one in many])
        for field in fields(BatchHistories)
        if field.name not in ("seeds", "time")
    }
    return BatchHistories(seeds=seeds, time=many[0].time, **stacked), began
