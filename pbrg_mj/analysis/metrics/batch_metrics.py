"""Figures and files of many worlds run side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.loop.batch import BatchHistories
from pbrg_mj.scenario.schema.scenario import Contacts


def batch_metrics(histories: BatchHistories, contacts: Contacts) -> dict[str, Any]:
    """Return what the worlds have in common and where they differ, units in the names.

    `contacts` are the scenario's: which contacts are violations.
    """
    least = histories.wall_margin.min(axis=(1, 2), initial=np.inf)  # (W,)
    known = least[np.isfinite(least)]
    spread = {"median": float(np.median(known)), "max": float(known.max())} if len(known) else {}
    touching, past = histories.wall_contact.any(axis=(1, 2)), least < 0.0
    bumping = histories.robot_contact.any(axis=(1, 2))
    violated = (touching | past) & (contacts.walls == "violation") | bumping & (contacts.robots == "violation")
    return {
        "worlds": len(histories.seeds),
        "simulated_s": float(histories.time[-1]),
        "worlds_violated": int(violated.sum()),
        "worlds_touching": int(touching.sum()),
        "worlds_touching_robots": int(bumping.sum()),
        "worlds_past_a_wall": int(past.sum()),
        "worlds_diverged": int(histories.diverged.any(axis=1).sum()),
        "true_margin_m": {"min": float(known.min()), **spread} if len(known) else None,
        "worst_seed": int(histories.seeds[int(least.argmin())]) if len(known) else None,
        "final_place_std_m": float(np.sqrt(histories.hand_world[:, -1].var(axis=0).sum(axis=1).max())),
    }


def arrays(histories: BatchHistories) -> dict[str, np.ndarray]:
    """Return all arrays by name and unit."""
    return {
        "seeds": np.array(histories.seeds),
        "time_s": histories.time,
        "hand_world_m": histories.hand_world,
        "m_m": histories.m,
        "wall_margin_m": histories.wall_margin,
        "wall_contact": histories.wall_contact,
        "robot_contact": histories.robot_contact,
        "diverged": histories.diverged,
    }


def save_batch(histories: BatchHistories, path: Path) -> None:
    """Write all arrays to `path`, which ends in .npz. Raises InputError for another suffix, or when it cannot."""
    write_atomically(path, lambda whole: by_suffix(path, WRITERS)(histories, whole))


def _write_npz(histories: BatchHistories, path: Path) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays(histories))  # pyright: ignore[reportArgumentType]


WRITERS = {".npz": _write_npz}
