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
from pbrg_mj.perception.scan_lines import LineBuffer, Workspace, line_buffer, scan_lines_into, workspace
from pbrg_mj.perception.separate import Stance
from pbrg_mj.perception.slots import fill
from pbrg_mj.perception.tracks import TrackRules
from pbrg_mj.perception.view import turn_into, view


class Makings(NamedTuple):
    """All that perception goes by."""

    directions: np.ndarray  # (beams, 2) unit vectors of the beams in the body frame
    blocked: np.ndarray  # (beams,) bool: the robot's own wheels are in the way
    rules: LineRules
    track_rules: TrackRules
    pose: PoseModel
    robots: np.ndarray  # (R,) robot of each row of the ranges
    teams: np.ndarray  # (n, k, 2) hull of the robots its half-spaces bind, from its hand point [m]
    binds: np.ndarray  # (n, n) bool: whom the half-spaces of each robot bind
    hand_offset: float  # of the hand point ahead of the body's centre [m]

    def plain(self) -> tuple:
        """Return the same without names: those of tuples are looked up again at each call of compiled code."""
        return tuple(tuple(part) if isinstance(part, tuple) else part for part in self)


class Known(NamedTuple):
    """What is known, robot by robot."""

    tracks: np.ndarray  # (n, M) of TRACK
    stands: np.ndarray  # (n,) of STAND
    G: np.ndarray  # (n, K, 2)
    h: np.ndarray  # (n, K)
    active: np.ndarray  # (n, K) bool
    binds: np.ndarray  # (n, K, n) bool


class Room(NamedTuple):
    """Scratch memory for one scan; nothing in it outlives one."""

    ranges: np.ndarray  # (beams,) [m]
    beams: np.ndarray  # (beams, 2) directions in the world
    work: Workspace
    lines: LineBuffer


@kernel
def perceive_scans(scans, makings, before, after):  # pragma: no cover - compiled
    """Write to `after` what is known after the scans of all robots that have beams. All arguments are plain tuples.

    scans = (ranges (R, beams) [m], estimates of poses (n, 3) [m, rad], pose_frame, scan_frame, time of use [s]);
    makings are `Makings.plain()`; before = (tracks, stands) of the scans before; after as in `Known`, without
    half-spaces yet.
    """
    ranges, poses, pose_frame, scan_frame, time = scans
    clock, known, by = Clock(pose_frame, scan_frame, time), Known(*after), _named(makings)
    known.tracks[:], known.stands[:] = before
    room = _room(len(by.directions))
    for row in range(len(by.robots)):
        robot = by.robots[row]
        if not math.isnan(poses[robot, 0] + poses[robot, 1] + poses[robot, 2]):  # else it cannot place a wall
            _perceive_scan(ranges[row], (robot, poses[robot], clock), by, room, known)


@kernel
def _named(makings):  # pragma: no cover - compiled
    directions, blocked, rules, track_rules, pose, robots, teams, binds, hand_offset = makings
    rules, track_rules, pose = LineRules(*rules), TrackRules(*track_rules), PoseModel(*pose)
    return Makings(directions, blocked, rules, track_rules, pose, robots, teams, binds, hand_offset)


@kernel
def _room(beams):  # pragma: no cover - compiled
    return Room(np.empty(beams), np.empty((beams, 2)), workspace(beams), line_buffer(beams))


@kernel
def _perceive_scan(read, whose, makings, room, known):  # pragma: no cover - compiled
    robot, estimate, clock = whose
    pose = stand(estimate, clock, known.stands[robot], makings.pose)
    _beyond_wheels(read, makings.blocked, room.ranges)
    count = scan_lines_into(room.ranges, makings.directions, makings.rules, room.work, room.lines)
    turn_into(room.beams, makings.directions, pose.heading)
    tracks = known.tracks[robot]
    follow(tracks, view(room.lines, count, room.ranges, room.beams, pose), makings.track_rules)
    stance = _stance(pose, makings.teams[robot], makings.hand_offset)
    G, h, active = known.G[robot], known.h[robot], known.active[robot]
    fill(tracks, stance, makings.track_rules, G, h, active)
    for k in range(len(h)):
        h[k] += G[k, 0] * pose.x + G[k, 1] * pose.y
        if active[k]:
            known.binds[robot, k] = makings.binds[robot]


@kernel
def _beyond_wheels(read, blocked, ranges):  # pragma: no cover - compiled
    """Write the ranges read to `ranges`, BLOCKED where they can only be the robot's own wheels."""
    for k in range(len(read)):
        ranges[k] = BLOCKED if blocked[k] else read[k]


@kernel
def _stance(pose, team, hand_offset):  # pragma: no cover - compiled
    hand = np.empty((1, 2))
    hand[0, 0], hand[0, 1] = hand_offset * math.cos(pose.heading), hand_offset * math.sin(pose.heading)
    return Stance(team + hand, hand, pose.position_var, pose.heading_var)
