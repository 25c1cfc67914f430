"""All scans of one moment, robot by robot, in compiled code."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.follow import follow
from pbrg_mj.perception.frames import Clock, PoseModel, stand
from pbrg_mj.perception.hits import BLOCKED
from pbrg_mj.perception.rules import LineRules
from pbrg_mj.perception.scan_lines import LineBuffer, Workspace, scan_lines_into
from pbrg_mj.perception.separate import Stance
from pbrg_mj.perception.slots import fill
from pbrg_mj.perception.tracks import TrackRules
from pbrg_mj.perception.view import view


class Scans(NamedTuple):
    """What the robots with beams have read."""

    ranges: np.ndarray  # (R, beams) [m]
    robots: np.ndarray  # (R,) robot of each row
    poses: np.ndarray  # (n, 3) estimates x, y [m], heading [rad]
    clock: Clock


class Known(NamedTuple):
    """Where what is known is written, robot by robot."""

    tracks: np.ndarray  # (n, M) of TRACK
    stands: np.ndarray  # (n,) of STAND
    G: np.ndarray  # (n, K, 2)
    h: np.ndarray  # (n, K)
    active: np.ndarray  # (n, K)


class Makings(NamedTuple):
    """All that perception goes by."""

    directions: np.ndarray  # (beams, 2) unit vectors of the beams in the body frame
    blocked: np.ndarray  # (beams,) bool: the robot's own wheels are in the way
    rules: LineRules
    track_rules: TrackRules
    pose: PoseModel
    teams: np.ndarray  # (n, k, 2) hull of the robots its half-spaces bind, from its hand point [m]
    hand_offset: float  # of the hand point ahead of the body's centre [m]


class Room(NamedTuple):
    """Scratch memory for one scan; nothing in it outlives one."""

    ranges: np.ndarray  # (beams,) [m]
    work: Workspace
    lines: LineBuffer


@kernel
def perceive_scans(scans, makings, room, known):
    """Bring tracks, stands and half-spaces in `known` up to date with the scans of all robots that have beams."""
    for row in range(len(scans.robots)):
        robot = scans.robots[row]
        estimate = scans.poses[robot]
        if math.isnan(estimate[0] + estimate[1] + estimate[2]):
            continue  # a robot that does not know where it is cannot place a wall
        pose = stand(estimate, scans.clock, known.stands[robot], makings.pose)
        ranges = _beyond_wheels(scans.ranges[row], makings.blocked, room.ranges)
        lines = _lines(ranges, makings, room)
        tracks = known.tracks[robot]
        follow(tracks, view(lines, ranges, makings.directions, pose), makings.track_rules)
        stance = _stance(pose, makings.teams[robot], makings.hand_offset)
        G, h, active = known.G[robot], known.h[robot], known.active[robot]
        active[:] = fill(tracks, stance, makings.track_rules, G, h)
        for k in range(len(h)):
            h[k] += G[k, 0] * pose.x + G[k, 1] * pose.y


@kernel
def _beyond_wheels(read, blocked, ranges):
    """Write the ranges read to `ranges`, BLOCKED where they can only be the robot's own wheels, and return it."""
    for k in range(len(read)):
        ranges[k] = BLOCKED if blocked[k] else read[k]
    return ranges


@kernel
def _lines(ranges, makings, room):
    out = room.lines
    count = scan_lines_into(ranges, makings.directions, makings.rules, room.work, out)
    return LineBuffer(
        out.angle[:count],
        out.offset[:count],
        out.covariance[:count],
        out.low[:count],
        out.high[:count],
        out.free_low[:count],
        out.free_high[:count],
    )


@kernel
def _stance(pose, team, hand_offset):
    hand = np.empty((1, 2))
    hand[0, 0], hand[0, 1] = hand_offset * math.cos(pose.heading), hand_offset * math.sin(pose.heading)
    return Stance(team + hand, hand, pose.position_var, pose.heading_var)
