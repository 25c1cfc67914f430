"""What stops advances of m in a scenario: what motors and steering can follow, and how far beams see."""

from __future__ import annotations

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.sight import SightLimit, sight
from pbrg_mj.governor.certificate.speed import UNLIMITED, SpeedLimit, disc_facets, turning_offset, wheel_facets
from pbrg_mj.governor.certificate.steering import mean_delay, steerable_speed
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.robot import load_robot_model


def advance_limits(scenario: Scenario, model: TeamModel, cycle_ticks: int) -> tuple[AdvanceLimit, ...]:
    """Return what stops advances of m. Raises InputError where beams are too short to move at all."""
    facets, robot, limits = speed_facets(scenario, scenario.governor.speed_rows), load_robot_model(scenario.robot), []
    grid = PredictionGrid.of(model)
    change = UNLIMITED
    if scenario.plant == "physics":
        change = wheel_facets(robot) * robot.time_constant / (cycle_ticks * model.tick)
    if len(facets) or len(change):
        limits.append(SpeedLimit.of(model, grid, facets, turning_offset(robot), change))
    estimator = scenario.estimator
    sees = estimator.source in ("beams", "points") and scenario.plant == "physics"
    if scenario.governor.sight_rows and sees and estimator.unknown == "free":  # else half-spaces end at what is seen
        limits.append(SightLimit.of(grid, np.array(scenario.beam_robots, dtype=np.int64), _sight(scenario)))
    return tuple(limits)


def speed_facets(scenario: Scenario, wheels: bool) -> np.ndarray:
    """Return the facets (F, 2) [s/m], in the body's axes, of the velocities that robots may be asked for."""
    control, robot = scenario.control, load_robot_model(scenario.robot)
    facets = [np.zeros((0, 2))]
    if scenario.plant == "physics" and wheels:
        facets.append(wheel_facets(robot))
        steerable = steerable_speed(robot, mean_delay(scenario))
        if steerable < robot.loaded_speed * robot.wheel_radius:
            facets.append(disc_facets(steerable, control.speed_facets))
    if control.speed_limit is not None:
        facets.append(disc_facets(control.speed_limit, control.speed_facets))
    return np.concatenate(facets)


def _sight(scenario: Scenario) -> float:
    """Return how far robots may go before a wall comes into view [m]. Raises InputError where that is nowhere."""
    seen, beams = sight(scenario, load_robot_model(scenario.robot)), scenario.sensors.beams
    if seen > 0.0:
        return seen
    raise InputError(
        f"is true, but beams of {beams.range_max:g} m at {beams.rate_hz:g} Hz show walls too late for any advance; "
        "allowed: longer or faster beams, or false",
        key="governor.sight_rows",
    )
