"""Figures and files of many worlds run side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.world_metrics import summary, world_metrics
from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.scenario.schema import Scenario


def batch_metrics(histories: BatchHistories, scenario: Scenario) -> dict[str, Any]:
    """Return what the worlds of a scenario have in common and where they differ, units in the names."""
    deviation = np.sqrt(histories.hand_world[:, -1].var(axis=0).sum(axis=1).max())
    return {**summary(world_metrics(histories, scenario)), "final_place_std_m": float(deviation)}


def arrays(histories: BatchHistories) -> dict[str, np.ndarray]:
    """Return all arrays by name and unit."""
    return {
        "seeds": np.array(histories.seeds),
        "time_s": histories.time,
        "hand_world_m": histories.hand_world,
        "m_m": histories.m,
        "wall_margin_m": histories.wall_margin,
        "moving_margin_m": histories.moving_margin,
        "wall_contact": histories.wall_contact,
        "moving_contact": histories.moving_contact,
        "robot_contact": histories.robot_contact,
        "diverged": histories.diverged,
        "certificate_violated": histories.certificate_violated,
    }


def save_arrays(arrays: Mapping[str, np.ndarray], path: Path) -> None:
    """Write arrays to `path`, which ends in .npz. Raises InputError for another suffix, or when it cannot."""
    write_atomically(path, lambda whole: by_suffix(path, WRITERS)(arrays, whole))


def _write_npz(arrays: Mapping[str, np.ndarray], path: Path) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]


WRITERS = {".npz": _write_npz}
