"""One tick of perception for all robots: scans to lines to tracks to obstacles to half-spaces."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.obstacle.half_space import BoundRobots
from pbrg_mj.perception.obstacle.slots import update_half_spaces
from pbrg_mj.perception.scan.extract_lines import (
    LineBuffer,
    LineWorkspace,
    line_buffer,
    line_workspace,
    write_lines,
)
from pbrg_mj.perception.scan.parameters import LineParameters
from pbrg_mj.perception.scan.points import BLOCKED
from pbrg_mj.perception.scan.team_mates import TeamMateModel, without_team_mates
from pbrg_mj.perception.setup import PerceptionParameters, PerceptionSetup
from pbrg_mj.perception.track.deskew import deskewed
from pbrg_mj.perception.track.filtered_poses import equivalent_variances
from pbrg_mj.perception.track.pose_history import PoseHistory, no_poses, poses_at_scan, with_poses
from pbrg_mj.perception.track.pose_noise import write_pose_covariances
from pbrg_mj.perception.track.records import TrackParameters, no_tracks
from pbrg_mj.perception.track.update import update_tracks
from pbrg_mj.perception.track.world_frame import (
    ANCHOR,
    PoseModel,
    lines_in_world,
    pose_at_scan,
    write_world_directions,
)
from pbrg_mj.sensing.readings import Readings


@dataclass(frozen=True)
class PerceptionMemory:
    """Every robot's tracks, the position at its last scan, and the half-spaces made of them. Never written to."""

    tracks: np.ndarray  # (n, M) of TRACK
    anchors: np.ndarray  # (n,) of ANCHOR
    history: PoseHistory
    half_spaces: HalfSpaces


def initial(setup: PerceptionSetup) -> PerceptionMemory:
    """Return the memory before the first tick: the given half-spaces, or none."""
    known = setup.given or HalfSpaces.empty(setup.robots, setup.slots)
    anchors, history = np.zeros(setup.robots, dtype=ANCHOR), no_poses(setup.robots, setup.parameters.pose.frames)
    return PerceptionMemory(no_tracks(setup.robots, setup.slots), anchors, history, known)


def perceive(
    readings: Readings, time: float, memory: PerceptionMemory, setup: PerceptionSetup
) -> tuple[HalfSpaces, PerceptionMemory]:
    """Return the half-spaces every robot knows at `time` [s], for hand points in the world, and the new memory.

    They change with a new scan only. A half-space is an obstacle as tracked over time, moved towards the robots by the
    clearance and `sigmas` standard deviations: a robot nearer to the obstacle than that
    lies outside its own half-space, and the caller sees it so.
    """
    if setup.given is not None:
        return memory.half_spaces, memory
    model = setup.parameters.pose
    history = with_poses(memory.history, readings, time, model)
    if not readings.new_scan:
        return memory.half_spaces, memory if history is memory.history else replace(memory, history=history)
    known = HalfSpaces.empty(setup.robots, setup.slots)
    tracks, anchors = np.empty(memory.tracks.shape, memory.tracks.dtype), np.empty_like(memory.anchors)
    at, filtered = poses_at_scan(history, readings, model), readings.pose_filter
    if filtered is not None:
        covariances = filtered.at_exposure.covariance, filtered.now.covariance
        variances = equivalent_variances(*covariances, model)
        at = at._replace(variances=variances, error_variances=variances)
    seen = tuple(deskewed(readings, history, at.poses, setup.parameters.robots, setup))
    scans = (seen, *at, time)
    written = (tracks, anchors, known.G, known.h, known.active, known.binds)
    perceive_scans(scans, setup.packed, (memory.tracks, memory.anchors), written)
    return known, PerceptionMemory(tracks, anchors, history, known)


class PerceptionArrays(NamedTuple):
    """What every robot knows: its tracks, its anchor and its half-spaces."""

    tracks: np.ndarray  # (n, M) of TRACK
    anchors: np.ndarray  # (n,) of ANCHOR
    G: np.ndarray  # (n, K, 2)
    h: np.ndarray  # (n, K)
    active: np.ndarray  # (n, K) bool
    binds: np.ndarray  # (n, K, n) bool


class ScanWorkspace(NamedTuple):
    """Scratch memory for one scan; nothing in it outlives one."""

    ranges: np.ndarray  # (beams,) [m]
    beams: np.ndarray  # (beams, 2) directions in the world
    fitting: LineWorkspace
    lines: LineBuffer
    pose_covariances: np.ndarray  # (L, 6) of lines by unit variances of poses, see pose_noise.py


@kernel
def perceive_scans(scans, packed, before, after):
    """Write to `after` what is known after the scans of all robots that have beams. All arguments are plain tuples.

    - scans: ranges (R, beams) [m], directions (R or 1, beams, 2), bodies (beams or 1, n, 2) [m] and shares (beams, J)
      or (1, 1) of DeskewedScans; poses (n, 3), variances (n, 2) and errors (n, 2), the error_variances, of PosesAtScan;
      time of use [s]
    - packed: the members of PerceptionParameters, in their order
    - before: tracks (n, M) of TRACK and anchors (n,) of ANCHOR, as they were after the scans before
    - after: the members of PerceptionArrays, in their order, with empty half-spaces
    """
    (ranges, directions, bodies, shares), poses, variances, errors, time = scans
    known = PerceptionArrays(*after)
    parameters = _named(packed)
    _copy(before, known)
    work = _scan_workspace(len(parameters.directions))
    for row in range(len(parameters.robots)):
        robot = parameters.robots[row]
        if not math.isnan(poses[robot, 0] + poses[robot, 1] + poses[robot, 2]):  # else it cannot place a line
            scan = ranges[row], directions[row if len(directions) > 1 else 0], bodies, shares
            _perceive_scan(scan, (robot, poses, variances, errors, time), parameters, work, known)


@kernel
def _copy(before, known):
    """Begin with what was known before, one by one: numba compiles a check with a formatted error for whole arrays."""
    tracks, anchors = before
    for robot in range(len(anchors)):
        known.anchors[robot] = anchors[robot]
        for i in range(tracks.shape[1]):
            known.tracks[robot, i] = tracks[robot, i]


@kernel
def _named(packed):
    """Return PerceptionParameters of a plain tuple of its members.

    Arguments: a part that is a tuple itself has lost its name, too.

    `packed` has them in their order; params and track_params are the members of LineParameters and TrackParameters.
    """
    directions, blocked, params, track_params, pose, robots, teams, binds, hand_offset, team_mate = packed
    params, track_params, pose = LineParameters(*params), TrackParameters(*track_params), PoseModel(*pose)
    model = TeamMateModel(*team_mate)
    return PerceptionParameters(
        directions, blocked, params, track_params, pose, robots, teams, binds, hand_offset, model
    )


@kernel
def _scan_workspace(beams):
    lines = line_buffer(beams)
    covariances = np.empty((len(lines.angle), 6))
    return ScanWorkspace(np.empty(beams), np.empty((beams, 2)), line_workspace(beams), lines, covariances)


@kernel
def _perceive_scan(scan, whose, parameters, work, known):
    (read, directions, bodies, shares), (robot, poses, variances, errors, time) = scan, whose
    pose = pose_at_scan(poses[robot], variances[robot], time, known.anchors[robot])
    _mask_own_wheels(read, parameters.blocked, work.ranges)
    count = write_lines(work.ranges, directions, parameters.line, work.fitting, work.lines)
    team = bodies, robot, parameters.team_mate
    count = without_team_mates(work.lines, count, work.fitting, pose, team, parameters.line)
    write_world_directions(work.beams, directions, pose.heading)
    tracks = known.tracks[robot]
    write_pose_covariances(work.fitting, count, parameters.line, shares, work.pose_covariances)
    lines = lines_in_world(work.lines, count, pose, errors[robot], work.pose_covariances)
    update_tracks(tracks, lines, (work.ranges, work.beams), pose, parameters.track)
    bound = _bound_robots(pose, parameters.teams[robot], parameters.hand_offset)
    G, h, active = known.G[robot], known.h[robot], known.active[robot]
    update_half_spaces(tracks, bound, parameters.track, G, h, active)
    for k in range(len(h)):
        h[k] += G[k, 0] * pose.x + G[k, 1] * pose.y
        if active[k]:
            for other in range(len(parameters.binds)):
                known.binds[robot, k, other] = parameters.binds[robot, other]


@kernel
def _mask_own_wheels(read, blocked, ranges):
    """Write the ranges read (beams,) [m] to `ranges` (beams,).

    BLOCKED where they can only be the robot's own wheels: `blocked` (beams,) bool.
    """
    for k in range(len(read)):
        ranges[k] = BLOCKED if blocked[k] else read[k]


@kernel
def _bound_robots(pose, team, hand_offset):
    hand = np.empty((1, 2))
    hand[0, 0], hand[0, 1] = hand_offset * math.cos(pose.heading), hand_offset * math.sin(pose.heading)
    return BoundRobots(team + hand, hand, pose.position_var, pose.heading_var)
