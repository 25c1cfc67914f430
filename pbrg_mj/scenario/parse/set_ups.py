"""Overrides that go by one name, `set_up=NAME`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

SET_UP = "set_up"
SET_UPS = ("recommended",)


class SetUpFor(NamedTuple):
    """What the recommended set-up depends on."""

    plant: str = "physics"
    drive: str = "voltage"
    all_see: bool = True  # every robot has beams
    blind_sides: bool = False  # their beams do not go all the way round, and unseen space is free


def overrides_of_set_up(given_for: SetUpFor) -> Sequence[str]:
    """Return what the recommended set-up sets; the overrides after it win.

    The ideal plant has neither beams nor motors. With points every robot keeps off what it sees itself: where some have
    no beams, lines of walls bind the whole team. Sight rows assume beams all the way round: where these leave a side
    blind, space counts as free only where a beam has passed. Motors make up for their own friction where voltage drives
    them; then xi need not leak, because the governor keeps them from the saturation that the leak counteracts.
    """
    given = [
        "governor.kind=certified",
        "governor.certificate=predictive",
        "governor.optimizer=flooding",
        "control.leak=0",
    ]
    if given_for.plant != "physics":
        return given
    if given_for.all_see:
        given += ["estimator.source=points", "estimator.scope=own", "estimator.half_spaces_per_robot=8"]
        given += ["estimator.unknown=closed"] if given_for.blind_sides else []
    else:
        given += ["estimator.source=beams", "estimator.scope=team"]
    return [*given, "drive.friction_compensation=true"] if given_for.drive == "voltage" else given


def set_up_for(data: Any) -> SetUpFor:
    """Return what the data of a scenario ask for, or what they are by default."""
    if not isinstance(data, Mapping):
        return SetUpFor()
    drive, beams = _section(data, "drive"), _section(_section(data, "sensors"), "beams")
    free = _section(data, "estimator").get("unknown", "free") == "free"
    return SetUpFor(
        plant=str(data.get("plant", "physics")),
        drive=str(drive.get("kind", "voltage")),
        all_see=beams.get("robots", "all") == "all",
        blind_sides=free and beams.get("sweep_deg", 360.0) != 360.0,
    )


def _section(data: Mapping[Any, Any], name: str) -> Mapping[Any, Any]:
    section = data.get(name)
    return section if isinstance(section, Mapping) else {}
