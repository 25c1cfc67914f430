"""Contacts of robots with walls, with moving boxes and with each other: which of them violate the run, and how many."""

from __future__ import annotations

from typing import Literal

import numpy as np

from pbrg_mj.log.read.run import Run

Kind = Literal["walls", "moving", "robots"]  # the keys of `outcome.contacts`
FIELDS: dict[Kind, str] = {"walls": "wall_contact", "moving": "moving_contact", "robots": "robot_contact"}


def contact_flags(run: Run, kind: Kind) -> np.ndarray:
    """Return which robot was in contact since the tick before (T, n)."""
    return getattr(run.ticks, FIELDS[kind])


def is_violation(run: Run, kind: Kind) -> bool:
    """Whether the scenario takes contacts of this kind for violations."""
    return getattr(run.scenario.outcome.contacts, kind) == "violation"


def onsets(flags: np.ndarray) -> list[list[int]]:
    """Return tick and robot wherever a flag (T, n) goes up."""
    return np.argwhere(flags & ~np.concatenate([np.zeros_like(flags[:1]), flags[:-1]])).tolist()


def contact_text(run: Run, kind: Kind, tick: int, robot: int) -> str:
    """Return with what a robot is in contact: a wall, a moving box, or which robot; robots count from 0 here."""
    if kind != "robots":
        return {"walls": "a wall", "moving": "a moving box"}[kind]
    # Contact is mutual, so the other robot is flagged too: of several the nearest.
    place, touching = run.ticks.body_pose_true[tick][:, :2], run.ticks.robot_contact[tick].copy()
    touching[robot] = False
    apart = np.where(touching, np.linalg.norm(place - place[robot], axis=1), np.inf)
    return f"robot {int(apart.argmin()) + 1}" if touching.any() else "another robot"
