"""Overrides that go by one name, `set_up=NAME`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SET_UP = "set_up"
SET_UPS = ("recommended",)


def overrides_of_set_up(plant: str, drive: str) -> Sequence[str]:
    """Return what the recommended set-up sets for a plant and a kind of drive; the overrides after it win.

    The ideal plant has neither beams nor motors. Motors make up for their own friction where voltage drives them; then
    xi need not leak, because the governor keeps them from the saturation that the leak counteracts.
    """
    given = [
        "governor.kind=certified",
        "governor.certificate=predictive",
        "governor.optimizer=flooding",
        "control.leak=0",
    ]
    if plant == "physics":
        given += ["estimator.source=points", "estimator.scope=own", "estimator.half_spaces_per_robot=8"]
        if drive == "voltage":
            given.append("drive.friction_compensation=true")
    return given


def plant_and_drive(data: Any) -> tuple[str, str]:
    """Return the plant and the kind of drive that the data of a scenario ask for, or what they are by default."""
    drive = data.get("drive") if isinstance(data, Mapping) else None
    kind = drive.get("kind", "voltage") if isinstance(drive, Mapping) else "voltage"
    return str(data.get("plant", "physics")) if isinstance(data, Mapping) else "physics", str(kind)
