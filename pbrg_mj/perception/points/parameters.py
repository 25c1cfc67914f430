"""Parameters of the point estimator, from a scenario and its robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri, pdtrc  # scipy.stats has the same, but takes a second to import

from pbrg_mj.perception.points.confirm import APART
from pbrg_mj.perception.points.corner_bound import MOST_LOST
from pbrg_mj.perception.points.known_free import WIDEST
from pbrg_mj.perception.points.occupancy_grid import CELLS, ROOM
from pbrg_mj.perception.scan.parameters import in_metres
from pbrg_mj.perception.scan.self_occlusion import blocked_beams
from pbrg_mj.perception.track.world_frame import PoseModel, pose_model
from pbrg_mj.scenario.schema import Beams, Scenario, beam_angles
from pbrg_mj.world.scene.robot import RobotModel

JOINING = 2.0  # gaps between beams that echoes of one thing are apart at most: faces are met at up to 60 deg
MOST_ECHOES = 16
ENOUGH = 432  # echoes that are remembered, six scans of 72 beams: what a noisy sensor misses in one is in another
FALSE_ECHOES = 1e-5  # outliers a scan that recent echoes confirm: one in three hours of scans
FALSELY_CONFIRMED = 1e-6  # and that all earlier ones do: in the open they stay as long as the memory does
SPAN = 0.3  # [s] between the scans whose difference is a speed: a thing at 0.1 m/s moves by more than ranges are wrong
LEAST_LAG = 2  # scans between them: the one in between confirms flows
LEAST_FREE = 0.8  # of the distance to the nearest place of a face, that its hull must leave to the path


class PointParameters(NamedTuple):
    """All parameters of the compiled code."""

    directions: np.ndarray  # (beams, 2) unit vectors in the body frame
    blocked: np.ndarray  # (beams,) bool: the robot's own wheels are in the way
    first: float  # angle of the first beam [rad]
    gap: float  # angle between beams [rad]
    closed: bool  # the beams go all the way round
    half_cone: float  # half the width of a beam's view [rad]; 0: a ray
    joining: np.ndarray  # (MOST_LOST + 1,) most that neighbours are apart for their range, 0, 1, ... beams between lost
    unseen: float  # angle between the views of two beams [rad]: a corner may stick out there
    scan_time: float  # from the first beam of a scan to its end [s]; 0: all at once
    range_std: float  # [m]
    noise_ratio: float  # [-]
    range_min: float  # [m]
    range_max: float  # [m]
    pose: PoseModel
    clearance: float  # of hand points from faces [m]
    hand_offset: float  # [m]
    body_radius: float  # of a team-mate [m]
    sigmas: float  # half-spaces move inward by this many standard deviations of a pose
    range_sigmas: np.ndarray  # (16,) and of a range where 1, 2, ... echoes tell of the face
    recent: int  # scans whose points are all kept
    lag: int  # scans between those whose difference is a speed
    reaction: float  # until a robot acts on what a scan shows, at the latest [s]
    outliers: bool  # an echo may be anywhere along its beam
    confirmations: int  # echoes of recent scans that a lone one needs at its place, or one more of
    confirming: int  # so many earlier scans
    confirmation_range: float  # within it as many of these as of the recent ones do: few outliers are so near [m]
    memory: float  # how long a point out of sight is kept [s]
    closed_beyond: bool  # what no beam has shown to be free binds
    silence_is_free: bool  # a beam without an echo shows its way to be free
    blind_radius: float  # of what is taken to be free on blind sides at the start, from the body's centre [m]
    cells: int  # known to be free or not along each side of a window around the robot; 0: there are no blind sides
    cell: float  # how wide these are [m]
    least_joining: float  # echoes nearer to each other are of one thing: robots pass between none of them [m]
    straight_length: float  # of a face that is straight, at least [m]
    rest_speed: float  # what may come faster is not at rest [m/s]
    long_extent: float  # faces so long bind robots that see nothing themselves [m]


def point_parameters(scenario: Scenario, robot: RobotModel) -> PointParameters:
    """Return the parameters for a scenario; the ideal plant is seen exactly."""
    beams, exact = scenario.assumed_sensors.beams, scenario.plant == "ideal"
    angles, pose = beam_angles(beams), pose_model(scenario)
    scan_time = 0.0 if exact else beams.scan_time
    cone = 0.0 if exact else math.radians(beams.cone_deg)
    gap = float(angles[1] - angles[0]) if len(angles) > 1 else 2.0 * math.pi
    recent = min(max(math.ceil(ENOUGH / beams.count), 2), 6)
    blocked = blocked_beams(beams, scenario.robot)
    room = blind_radius(robot, scenario.estimator.sigmas * math.sqrt(pose.position_var))
    remembered = max(math.floor(scenario.estimator.memory / pose.scan_period), recent)
    needed, confirming, near = confirmation_rule(beams, exact, recent, remembered)
    return PointParameters(
        directions=np.column_stack([np.cos(angles), np.sin(angles)]),
        blocked=blocked,
        first=float(angles[0]),
        gap=gap,
        closed=beams.sweep_deg == 360.0,
        half_cone=0.5 * cone,
        joining=np.array([JOINING * math.sin(min(k * gap, 0.5 * math.pi)) for k in range(1, MOST_LOST + 2)]),
        unseen=max(gap - cone, 0.0),
        scan_time=scan_time,
        range_std=0.0 if exact else math.hypot(beams.noise_std, beams.quantum / math.sqrt(12.0)),
        noise_ratio=0.0 if exact else beams.noise_ratio,
        range_min=beams.range_min,
        range_max=beams.range_max,
        pose=pose,
        clearance=robot.clearance,
        hand_offset=robot.hand_offset,
        body_radius=robot.body_radius,
        sigmas=scenario.estimator.sigmas,
        range_sigmas=range_sigmas(scenario.estimator.sigmas),
        recent=recent,
        lag=min(max(round(SPAN / pose.scan_period), LEAST_LAG), 6),
        reaction=pose.scan_period if exact else pose.scan_period + pose.frame_period + robot.time_constant + scan_time,
        outliers=not exact and beams.outliers > 0.0,
        confirmations=needed,
        confirming=confirming,
        confirmation_range=near,
        memory=scenario.estimator.memory,
        closed_beyond=scenario.estimator.unknown != "free",
        silence_is_free=scenario.estimator.unknown != "strict",
        blind_radius=room,
        cells=grid_size(room, robot) if has_blind_sector(scenario, angles[~blocked]) else 0,
        cell=robot.clearance / CELLS,
        least_joining=in_metres(scenario.estimator.thresholds.joining, robot.clearance),
        straight_length=in_metres(scenario.estimator.thresholds.straight_length, robot.clearance),
        rest_speed=scenario.estimator.thresholds.rest_speed,
        long_extent=scenario.estimator.thresholds.long_extent,
    )


def blind_radius(robot: RobotModel, error: float) -> float:
    """Return how much room around its centre a robot knows of without any beam [m]; `error` is its place's [m].

    Its hand point may then go round it, whatever a hull takes of the room.
    """
    return (robot.clearance + robot.hand_offset + error) / LEAST_FREE


def has_blind_sector(scenario: Scenario, angles: np.ndarray) -> bool:
    """Tell whether unseen space is not free, and beams at angles (N,) [rad] leave a side unseen."""
    if scenario.estimator.unknown == "free" or len(angles) == 0:
        return False
    gaps = np.diff(angles, append=angles[0] + 2.0 * math.pi)
    return scenario.estimator.unknown == "strict" or bool(gaps.max() > WIDEST)


def grid_size(room: float, robot: RobotModel) -> int:
    """Return how many cells hold the disc of radius `room` [m] in which a robot turns, and where it came from."""
    return 2 * math.ceil((room / robot.clearance + ROOM) * CELLS) + 1


def confirmation_rule(beams: Beams, exact: bool, recent: int, remembered: int) -> tuple[int, int, float]:
    """Return the numbers of an M-of-N rule for lone echoes, by which outliers hardly ever confirm each other.

    They are how many recent echoes are needed, of how many earlier scans, at most `remembered`, one more is enough, and
    the range [m] within which as many of these are.
    """
    if exact:
        return 1, remembered, beams.range_max
    needed = confirmations(beams, recent)
    confirming = confirming_scans(beams, needed + 1, recent, remembered)
    return needed, confirming, confirmation_range(beams, needed, confirming)


def confirmations(beams: Beams, recent: int) -> int:
    """Return how many recent echoes confirm a lone one, so that outliers hardly ever confirm each other."""
    needed = 1
    while _false_echoes(beams, needed, recent) > FALSE_ECHOES and needed < recent:
        needed += 1
    return needed


def confirming_scans(beams: Beams, needed: int, least: int, most: int) -> int:
    """Return in how many earlier scans so many echoes may be: a thin thing between two beams is missed by most."""
    scans = least
    while scans < most and _false_echoes(beams, needed, scans + 1) <= FALSELY_CONFIRMED:
        scans += 1
    return scans


def confirmation_range(beams: Beams, needed: int, scans: int) -> float:
    """Return the range [m] within which so many echoes of so many earlier scans confirm outliers as seldom."""
    false = _false_echoes(beams, needed, scans)
    span = beams.range_max - beams.range_min
    return beams.range_max if false <= FALSE_ECHOES else beams.range_min + span * FALSE_ECHOES / false


def _false_echoes(beams: Beams, needed: int, scans: int) -> float:
    """Return how many outliers a scan are confirmed by others in so many earlier scans.

    An outlier is anywhere along its beam. It meets one of the earlier scan's at a rate of their number times the share
    of that scan that counts as the same place; by chance that happens a Poisson-distributed number of times.
    """
    outliers, middle = beams.outliers * beams.count, beams.range_max / 2
    std = math.hypot(beams.noise_std, beams.noise_ratio * middle)
    length = 2.0 * (3.0 * math.sqrt(2.0) * std + APART)
    share = min(length / (beams.range_max - beams.range_min), 1.0) * 3.0 / beams.count
    return float(outliers * pdtrc(needed - 1, outliers * share * scans))


def range_sigmas(sigmas: float) -> np.ndarray:
    """Return how many standard deviations the nearest of N = 1, ..., 16 echoes of a face may lie behind it, (16,).

    As seldom as one echo lies `sigmas` of them behind: (1 - Phi(s))^N = 1 - Phi(sigmas), and no less than 0.
    """
    tail = ndtr(-sigmas)
    return np.maximum(-ndtri(tail ** (1.0 / np.arange(1, MOST_ECHOES + 1))), 0.0)
