"""Where the hand-written MJCF lies: in an installed package or in a checkout."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from pathlib import Path

import mujoco

_PACKAGE = Path(__file__).resolve().parents[1]


def model_path(name: str) -> Path:
    """Return the file of the model `name` ("robot" or "arena").

    Raises FileNotFoundError when neither an installed package nor a checkout holds it.
    """
    places = [_PACKAGE / "_data" / "models", _PACKAGE.parent / "models"]
    for place in places:
        if (path := place / f"{name}.xml").is_file():
            return path
    raise FileNotFoundError(f"no model {name}.xml in {' or '.join(map(str, places))}")


def load_spec(name: str) -> mujoco.MjSpec:
    """Return a fresh, editable copy of the model `name`."""
    return mujoco.MjSpec.from_file(str(model_path(name)))
