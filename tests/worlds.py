"""Small scenarios for the tests of the world."""

from __future__ import annotations

from typing import Any

from pbrg_mj.scenario.schema import Scenario

APART = 0.5  # between the start points of a row of robots [m]


def scenario(robots: int = 1, *, walls: tuple = (), beams: Any = (), **sections: Any) -> Scenario:
    """Return `robots` hand points in a row along +x from the origin, headed along +x, with the given extras."""
    team = {"start": [(APART * j, 0.0) for j in range(robots)], "formation": [(0, 0)] * robots, "leaders": [1]}
    sensors = {"beams": {"robots": beams} if not isinstance(beams, dict) else beams}
    data = {"team": team, "operator": {"reference": (1, 1)}, "world": {"walls": walls}, "sensors": sensors}
    for name, section in sections.items():
        old = data.get(name)
        data[name] = old | section if isinstance(old, dict) and isinstance(section, dict) else section
    return Scenario.model_validate(data)


def wall(start: tuple[float, float], end: tuple[float, float], thickness: float = 0.1) -> dict:
    return {"from": start, "to": end, "thickness": thickness}
