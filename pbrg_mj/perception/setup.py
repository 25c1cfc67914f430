"""What perception needs to know of a scenario, once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Estimator, GivenHalfSpace, Scenario
from pbrg_mj.sensing.noise import sensor_noise

NOISE_FLOOR = 1e-3  # [m] below this, straight walls and exact ranges no longer are
NOISE_MARGIN = 4.0  # in standard deviations: points this far from their line are split off, never nearer ones


@dataclass(frozen=True)
class SegmentRules:
    """When consecutive points of a scan are one straight wall."""

    range_std: float  # of the ranges, at least NOISE_FLOOR [m]
    split_distance: float  # [m]
    min_points: int
    min_length: float  # [m]


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations of a robot's own pose estimate."""

    position: float  # [m]
    heading: float  # [rad]


@dataclass(frozen=True)
class PerceptionSetup:
    """All parameters of perception, frozen."""

    robots: int
    slots: int  # half-spaces per robot
    clearance: float  # body radius plus hand offset [m]
    beam_robots: tuple[int, ...]  # robot of each row of the ranges
    directions: np.ndarray  # (beams, 2) unit vectors of the beams in the body frame
    rules: SegmentRules
    pose_noise: PoseNoise
    memory: float  # how long an unseen wall is kept [s]
    given: HalfSpaces | None  # for `source: given`; None when walls come from the beams


def perception_setup(scenario: Scenario, clearance: float) -> PerceptionSetup:
    """Return the setup for a scenario; `clearance` [m] is how far a hand point must stay from a wall's face.

    Raises InputError when given half-spaces do not fit: no such robot, zero normal, more than there are slots.
    """
    estimator, noise = scenario.estimator, sensor_noise(scenario)
    count = scenario.sensors.beams.count
    range_std = max(noise.range_std, NOISE_FLOOR)
    return PerceptionSetup(
        robots=scenario.robots,
        slots=estimator.half_spaces_per_robot,
        clearance=clearance,
        beam_robots=scenario.beam_robots,
        directions=beam_directions(count),
        rules=SegmentRules(
            range_std,
            max(estimator.split_distance, NOISE_MARGIN * range_std),
            estimator.min_points,
            estimator.min_length,
        ),
        pose_noise=PoseNoise(noise.position_std, noise.heading_std),
        memory=estimator.memory,
        given=given_half_spaces(estimator, scenario.robots) if estimator.source == "given" else None,
    )


def beam_directions(count: int) -> np.ndarray:
    """Return (count, 2) unit vectors in the body frame: beam 0 straight ahead, then counter-clockwise."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def given_half_spaces(estimator: Estimator, robots: int) -> HalfSpaces:
    """Return the half-spaces that robots know from the start, rows normalised, in the order given.

    Raises InputError for a robot that does not exist, a zero normal, and more half-spaces than slots.
    """
    result = HalfSpaces.empty(robots, estimator.half_spaces_per_robot)
    used = np.zeros(robots, dtype=int)
    for index, given in enumerate(estimator.given):
        normal, length = np.array(given.normal), float(np.hypot(*given.normal))
        _check(given, f"estimator.given[{index}]", length, robots)
        robot, slot = given.robot - 1, used[given.robot - 1]
        if slot == estimator.half_spaces_per_robot:
            raise InputError(
                f"robot {given.robot} is given more half-spaces than the {slot} it can hold", key="estimator.given"
            )
        result.G[robot, slot], result.h[robot, slot] = normal / length, given.offset / length
        result.active[robot, slot] = result.binds[robot, slot] = True
        used[robot] += 1
    return result


def _check(given: GivenHalfSpace, key: str, length: float, robots: int) -> None:
    if given.robot > robots:
        raise InputError(f"{given.robot} is no robot; allowed are 1 to {robots}", key=f"{key}.robot")
    if not length > 0:
        raise InputError(f"{list(given.normal)} has no direction; any other vector is allowed", key=f"{key}.normal")
