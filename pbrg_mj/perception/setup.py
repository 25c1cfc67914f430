"""Parameters of perception, made from a scenario once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.obstacle.polygons import hull
from pbrg_mj.perception.scan.parameters import LineParameters, line_parameters
from pbrg_mj.perception.scan.self_occlusion import blocked_beams
from pbrg_mj.perception.scan.team_mates import TeamMateModel
from pbrg_mj.perception.track.records import TrackParameters, track_parameters
from pbrg_mj.perception.track.world_frame import PoseModel, pose_model
from pbrg_mj.scenario.schema import Estimator, GivenHalfSpace, Scenario, beam_angles


class PerceptionParameters(NamedTuple):
    """All parameters of the compiled code."""

    directions: np.ndarray  # (beams, 2) unit vectors of the beams in the body frame
    blocked: np.ndarray  # (beams,) bool: the robot's own wheels are in the way
    line: LineParameters
    track: TrackParameters
    pose: PoseModel
    robots: np.ndarray  # (R,) robot of each row of the ranges
    teams: np.ndarray  # (n, k, 2) hull of the robots its half-spaces bind, from its hand point [m]
    binds: np.ndarray  # (n, n) bool: which robots the half-spaces of each robot bind
    hand_offset: float  # of the hand point ahead of the body's centre [m]
    team_mate: TeamMateModel

    def packed(self) -> tuple:
        """Return the same without names: those of tuples are looked up again at each call of compiled code."""
        return tuple(tuple(part) if isinstance(part, tuple) else part for part in self)


@dataclass(frozen=True)
class PerceptionSetup:
    """All parameters of perception, frozen."""

    robots: int
    slots: int  # half-spaces per robot
    parameters: PerceptionParameters
    scan_time: float  # from the first beam of a scan to its end [s]; 0: all at once
    packed: tuple  # the parameters as `perceive_scans` takes them
    given: HalfSpaces | None  # for `source: given`; None when they come from the beams

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors (beams, 2) of the beams in the body frame."""
        return self.parameters.directions

    @property
    def range_max(self) -> float:
        """Range limit of the beams [m]."""
        return self.parameters.line.range_max

    @property
    def pose(self) -> PoseModel:
        """Noise and clock of the robots' pose estimates."""
        return self.parameters.pose

    @property
    def line_params(self) -> LineParameters:
        """Parameters of the lines."""
        return self.parameters.line


def perception_setup(
    scenario: Scenario, clearance: float, hand_offset: float = 0.0, body_radius: float = 0.0
) -> PerceptionSetup:
    """Return the setup for a scenario.

    `clearance` [m] is how far a hand point must stay from a wall's face, `hand_offset` [m] how far it is ahead of
    the body's centre, `body_radius` [m] that of team-mates, 0 where nobody tells their places.
    Raises InputError when given half-spaces do not fit: no such robot, zero normal, more than there are slots.
    """
    estimator, params, robots = scenario.estimator, line_parameters(scenario, clearance), scenario.robots
    formation, beams = np.array(scenario.team.formation, dtype=float), scenario.sensors.beams
    parameters = PerceptionParameters(
        directions=unit_vectors(beam_angles(beams)),
        blocked=blocked_beams(beams, scenario.robot),
        line=params,
        track=track_parameters(scenario, params.agree, clearance),
        pose=pose_model(scenario),
        robots=np.array(scenario.beam_robots, dtype=np.int64),
        teams=np.array([_team(formation, robot, estimator.scope) for robot in range(robots)]),
        binds=_binds(robots, estimator.scope),
        hand_offset=float(hand_offset),
        team_mate=TeamMateModel(float(body_radius), 0.5 * math.radians(scenario.assumed_sensors.beams.cone_deg)),
    )
    return PerceptionSetup(
        robots=robots,
        slots=estimator.half_spaces_per_robot,
        parameters=parameters,
        scan_time=0.0 if scenario.plant == "ideal" else scenario.assumed_sensors.beams.scan_time,
        packed=parameters.packed(),
        given=given_half_spaces(estimator, robots) if estimator.source == "given" else None,
    )


def unit_vectors(angle: np.ndarray) -> np.ndarray:
    """Return (k, 2) unit vectors in the directions `angle` (k,) [rad]."""
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _team(formation: np.ndarray, robot: int, scope: str) -> np.ndarray:
    """Return (k, 2) corners of the hull of the robots bound, as seen from robot `robot` in formation [m]."""
    return formation[hull(formation)] - formation[robot] if scope == "team" else np.zeros((1, 2))


def _binds(robots: int, scope: str) -> np.ndarray:
    return np.ones((robots, robots), dtype=bool) if scope == "team" else np.eye(robots, dtype=bool)


def given_half_spaces(estimator: Estimator, robots: int) -> HalfSpaces:
    """Return the half-spaces that robots know from the start, rows normalised, in the order given.

    Raises InputError for a robot that does not exist, a zero normal, and more half-spaces than slots.
    """
    result, binds = HalfSpaces.empty(robots, estimator.half_spaces_per_robot), _binds(robots, estimator.scope)
    used = np.zeros(robots, dtype=int)
    for index, given in enumerate(estimator.given):
        normal, length = np.array(given.normal), float(np.hypot(*given.normal))
        _check(given, f"estimator.given[{index}]", length, robots)
        robot, slot = given.robot - 1, used[given.robot - 1]
        if slot == estimator.half_spaces_per_robot:
            raise InputError(
                f"robot {given.robot} is given more half-spaces than the {slot} it can hold",
                key="estimator.given",
            )
        result.G[robot, slot], result.h[robot, slot] = normal / length, given.offset / length
        result.active[robot, slot], result.binds[robot, slot] = True, binds[robot]
        used[robot] += 1
    return result


def _check(given: GivenHalfSpace, key: str, length: float, robots: int) -> None:
    if given.robot > robots:
        raise InputError(f"{given.robot} is no robot; allowed are 1 to {robots}", key=f"{key}.robot")
    if not length > 0:
        raise InputError(f"{list(given.normal)} has no direction; any other vector is allowed", key=f"{key}.normal")
