"""The hand-written MJCF as editable specs."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Literal

import mujoco

from pbrg_mj.scenario.bundled import data_dir


def load_spec(name: Literal["robot", "arena"]) -> mujoco.MjSpec:
    """Return a fresh, editable copy of a model."""
    return mujoco.MjSpec.from_file(str(data_dir("models") / f"{name}.xml"))
