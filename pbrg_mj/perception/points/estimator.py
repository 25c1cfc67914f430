"""One tick of the point estimator for all robots."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.deskew import PoseHistory, deskewed, no_poses, with_poses
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.known_free import edge_of_free
from pbrg_mj.perception.points.memory import forget, no_points
from pbrg_mj.perception.points.motion import PAST, PLACE, TRACK, TRACKS, closing_speeds
from pbrg_mj.perception.points.parameters import PointParameters
from pbrg_mj.perception.points.separate import separate
from pbrg_mj.perception.track.world_frame import ANCHOR, Clock, pose_at_scan
from pbrg_mj.sensing.readings import Readings


class PointMemory(NamedTuple):
    """Every robot's points, its position at the last scan, and the half-spaces made of them. Never written to."""

    points: np.ndarray  # (n, M) of POINT
    anchors: np.ndarray  # (n,) of ANCHOR
    past: np.ndarray  # (n, lag, beams) of PAST
    places: np.ndarray  # (n, lag) of PLACE
    tracks: np.ndarray  # (n, TRACKS) of TRACK
    history: PoseHistory
    scans: int
    half_spaces: HalfSpaces


@dataclass(frozen=True)
class PointEstimator:
    """Scans to points to half-spaces, each for the robot that sees it."""

    parameters: PointParameters
    robots: np.ndarray  # (R,) robot of each row of the ranges
    formation: np.ndarray  # (n, 2) b [m]
    slots: int  # half-spaces a robot

    def init(self) -> PointMemory:
        """Return a memory of nothing."""
        n = len(self.formation)
        nothing = HalfSpaces.empty(n, self.slots)
        lag, beams = self.parameters.lag, len(self.parameters.directions)
        points, anchors = no_points(n, beams, self.parameters.recent), np.zeros(n, dtype=ANCHOR)
        motion = np.zeros((n, lag, beams), PAST), np.zeros((n, lag), PLACE), np.zeros((n, TRACKS), TRACK)
        return PointMemory(points, anchors, *motion, no_poses(n, self.parameters.frames), 0, nothing)

    def step(self, readings: Readings, time: float, memory: PointMemory) -> tuple[HalfSpaces, PointMemory]:
        """Do what `step_towards` does for robots that stay where they are."""
        return self.step_towards(readings, time, memory, None)

    def step_towards(
        self, readings: Readings, time: float, memory: PointMemory, m: np.ndarray | None
    ) -> tuple[HalfSpaces, PointMemory]:
        """Return the half-spaces every robot knows at `time` [s], and the new memory.

        `m` (n, 2) [m] are the governed references that robots hold, None before the first tick. Half-spaces change
        with a new scan only.
        """
        history = with_poses(memory.history, readings, time, self.parameters)
        if not readings.new_scan:
            return memory.half_spaces, memory if history is memory.history else memory._replace(history=history)
        points, anchors = memory.points.copy(), memory.anchors.copy()
        motion = memory.past.copy(), memory.places.copy(), memory.tracks.copy()
        before, known = memory.half_spaces, HalfSpaces.empty(len(self.formation), self.slots)
        known.G[:], known.h[:], known.active[:] = before.G, before.h, before.active
        closing = np.zeros(known.h.shape)
        targets = np.full(self.formation.shape, np.nan) if m is None else m + self.formation
        seen = tuple(deskewed(readings, history, self.robots, self.parameters))
        scans = (seen, readings.body_pose, readings.pose_frame, readings.scan_frame, time, memory.scans + 1)
        written = (points, anchors, motion, (known.G, known.h, known.active, closing))
        perceive_points(scans, self.parameters, self.robots, targets, written)
        robots = np.arange(len(known.active))
        known.binds[robots, :, robots] = known.active
        known = replace(known, closing=closing)
        return known, PointMemory(points, anchors, *motion, history, memory.scans + 1, known)


@kernel
def perceive_points(scans, parameters, robots, targets, written):
    """Write points, anchors and half-spaces after the scans of all robots that have beams."""
    (ranges, directions, bodies), poses, pose_frame, scan_frame, time, scan = scans
    points, anchors, (past, places, tracks), (G, h, active, closing) = written
    clock = Clock(pose_frame, scan_frame, time)
    for row in range(len(robots)):
        robot = robots[row]
        if math.isnan(poses[robot, 0] + poses[robot, 1] + poses[robot, 2]):  # else it cannot place an echo
            continue
        pose = pose_at_scan(poses[robot], clock, anchors[robot], parameters.pose)
        beams = SeenBeams(ranges[row], directions[row if len(directions) > 1 else 0])
        forget(points[robot], scan, beams, pose, parameters)
        echoes = add_scan(points[robot], scan, beams, pose, (bodies, robot), parameters)
        edge = edge_of_free(echoes, beams, pose, parameters)
        q = np.empty(2)
        q[0] = pose.x + parameters.hand_offset * math.cos(pose.heading)
        q[1] = pose.y + parameters.hand_offset * math.sin(pose.heading)
        target = q if math.isnan(targets[robot, 0]) else targets[robot]
        half_spaces = G[robot], h[robot], active[robot]
        separate((points[robot], edge), q, target, parameters, half_spaces)
        motion = past[robot], places[robot], tracks[robot]
        closing_speeds((echoes, beams), motion, pose, parameters, half_spaces, closing[robot])
        for k in range(len(h[robot])):
            h[robot, k] -= parameters.reaction * closing[robot, k]
