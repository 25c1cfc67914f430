"""What the chosen robot has no use for."""

from __future__ import annotations

from collections.abc import Iterator

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema import Beams, Scenario


def robots(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield keys that mean something for other robots only."""
    robot, world = scenario.robot, scenario.world
    if robot != "generic" and scenario.sensors.beams.height != Beams().height:
        message = f"is {scenario.sensors.beams.height} m; allowed: with `robot: generic`, others have one height"
        yield Diagnostic(("sensors", "beams", "height"), message)
    if robot != "omni":
        return
    wheels = {
        ("world", "patches"): bool(world.patches),
        ("world", "thresholds"): bool(world.thresholds),
        ("world", "ramps"): bool(world.ramps),
        ("world", "rolling_resistance"): bool(world.rolling_resistance),
        ("world", "floor_friction"): world.floor_friction != type(world)().floor_friction,
        ("disturbances", "dead_motors"): bool(scenario.disturbances.dead_motors),
    }
    for path, given in wheels.items():
        if given:
            yield Diagnostic(path, "is given; allowed: with robots on two wheels, not with `robot: omni`")
