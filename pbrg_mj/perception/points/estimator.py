"""One tick of the point estimator for all robots."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.approach import move_half_spaces
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.blind_zone_points import assign_velocities, predict_blind_zone_points
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.face import REACH
from pbrg_mj.perception.points.face_track import TRACK, TRACKS, any_moving_within
from pbrg_mj.perception.points.initial_blind_zone import extrapolate_into_blind_zone
from pbrg_mj.perception.points.known_free import edge_of_free
from pbrg_mj.perception.points.lines import line_at, no_lines
from pbrg_mj.perception.points.memory import capacity_after, copy_records, delete_stale, no_points, slots_used
from pbrg_mj.perception.points.occupancy_grid import OccupancyGrid, empty_grids
from pbrg_mj.perception.points.parameters import PointParameters
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE
from pbrg_mj.perception.points.separate import separate
from pbrg_mj.perception.track.deskew import deskewed
from pbrg_mj.perception.track.pose_history import PoseHistory, no_poses, poses_at_scan, with_poses
from pbrg_mj.perception.track.world_frame import ANCHOR, pose_at_scan
from pbrg_mj.sensing.readings import Readings


class PointMemory(NamedTuple):
    """Every robot's points, its position at the last scan, and the half-spaces made of them. Never written to."""

    points: np.ndarray  # (n, M) of POINT, no more than are needed
    used: int  # of these M: those from here on are free
    anchors: np.ndarray  # (n,) of ANCHOR
    past: np.ndarray  # (n, lag, beams) of PAST_ECHO
    past_poses: np.ndarray  # (n, lag) of PAST_POSE
    tracks: np.ndarray  # (n, TRACKS) of TRACK
    free: np.ndarray  # (n, C, C) bool, of `OccupancyGrid`
    least: np.ndarray  # (n, 2) int64
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
        motion = np.zeros((n, lag, beams), PAST_ECHO), np.zeros((n, lag), PAST_POSE), np.zeros((n, TRACKS), TRACK)
        history = no_poses(n, self.parameters.pose.frames)
        grids = empty_grids(n, self.parameters.cells)
        return PointMemory(no_points(n, 0), 0, np.zeros(n, dtype=ANCHOR), *motion, *grids, history, 0, nothing)

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
        history = with_poses(memory.history, readings, time, self.parameters.pose)
        if not readings.new_scan:
            memory = memory if history is memory.history else memory._replace(history=history)
            if memory.scans == 0 and len(self.robots) > 0 and not memory.half_spaces.active.any():
                memory = memory._replace(half_spaces=self._before_the_first_scan(readings))
            return memory.half_spaces, memory
        n, beams = len(self.formation), len(self.parameters.directions)
        points = no_points(n, capacity_after(memory.used, beams, self.parameters.recent))
        anchors, past = np.empty(memory.anchors.shape, ANCHOR), np.empty(memory.past.shape, PAST_ECHO)
        past_poses, tracks = np.empty(memory.past_poses.shape, PAST_POSE), np.empty(memory.tracks.shape, TRACK)
        free, least = np.empty_like(memory.free), np.empty_like(memory.least)
        known = _as_known(memory.half_spaces if memory.scans > 0 else HalfSpaces.empty(n, self.slots))
        targets = np.full(self.formation.shape, np.nan) if m is None else m + self.formation
        at = poses_at_scan(history, readings, self.parameters.pose)
        seen = deskewed(readings, history, at.poses, self.robots, self.parameters)
        scans = ((seen.ranges, seen.directions, seen.bodies), at.poses, at.variances, time, memory.scans + 1)
        after = (
            points,
            anchors,
            past,
            past_poses,
            tracks,
            free,
            least,
            (known.G, known.h, known.active, known.binds, known.closing, known.spans),
        )
        used = perceive_points(scans, self.parameters, self.robots, targets, memory[:8], after)
        motion = past, past_poses, tracks
        return known, PointMemory(points, used, anchors, *motion, free, least, history, memory.scans + 1, known)

    def _before_the_first_scan(self, readings: Readings) -> HalfSpaces:
        """Return half-spaces that leave robots with beams where they are: nothing else is known to be free."""
        held, q = HalfSpaces.empty(len(self.formation), self.slots), readings.body_pose[:, :2].copy()
        for axis, ahead in enumerate((np.cos, np.sin)):
            q[:, axis] += self.parameters.hand_offset * ahead(readings.body_pose[:, 2])
        for robot in self.robots:
            for k, normal in enumerate(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))):
                held.G[robot, k], held.h[robot, k] = normal, np.dot(normal, q[robot])
                held.active[robot, k] = held.binds[robot, k, robot] = True
        return held


def _as_known(before: HalfSpaces) -> HalfSpaces:
    """Return the half-spaces of the scan before, which bind nobody yet and do not move."""
    binds, closing = np.zeros(before.binds.shape, dtype=bool), np.zeros(before.h.shape)
    spans = np.zeros(before.G.shape)
    return HalfSpaces(before.G.copy(), before.h.copy(), before.active.copy(), binds, closing, spans)


@kernel
def perceive_points(scans, parameters, robots, targets, before, after):
    """Write what is known `after` the scans of R robots that have beams; return how many places for points are used.

    Beside what moves half-spaces are made for where the robot is, not for its way: a half-space that leaves the way
    past a box free is nearer to the robot than the box is, and falls with it.

    - scans: ranges (R, beams) [m], directions (R or 1, beams, 2), bodies (beams or 1, n, 2) [m]; poses (n, 3) and
      variances (n, 2) of PosesAtScan; time [s] and number of the scan
    - robots (R,), targets (n, 2) [m], NaN before the first tick
    - before: the first eight members of PointMemory as they were: points, used, anchors, past, past_poses, tracks,
      free, least
    - after: points, anchors, past, past_poses, tracks, free, least of PointMemory, and G, h, active, binds, closing,
      spans of HalfSpaces
    """
    (ranges, directions, bodies), poses, variances, time, scan = scans
    points, anchors, past, past_poses, tracks, free, least, (G, h, active, binds, closing, spans) = after
    _copy(before, after)
    for row in range(len(robots)):
        robot = robots[row]
        if math.isnan(poses[robot, 0] + poses[robot, 1] + poses[robot, 2]):  # else it cannot place an echo
            continue
        pose = pose_at_scan(poses[robot], variances[robot], time, anchors[robot])
        beams = SeenBeams(ranges[row], directions[row if len(directions) > 1 else 0])
        predict_blind_zone_points(points[robot], pose, parameters)
        delete_stale(points[robot], scan, beams, pose, parameters)
        motion = past[robot], past_poses[robot], tracks[robot]
        echoes = add_scan(points[robot], scan, beams, pose, (bodies, robot), motion[:2], parameters)
        if pose.elapsed == 0.0:  # its first scan
            extrapolate_into_blind_zone(points[robot], scan, (echoes, beams), pose, parameters)
        edge = edge_of_free(echoes, beams, pose, OccupancyGrid(free[robot], least[robot]), parameters)
        q = np.empty(2)
        q[0] = pose.x + parameters.hand_offset * math.cos(pose.heading)
        q[1] = pose.y + parameters.hand_offset * math.sin(pose.heading)
        stays = math.isnan(targets[robot, 0]) or any_moving_within(tracks[robot], q, REACH)
        target = q if stays else targets[robot]
        slots = len(h[robot])
        half_spaces = G[robot], h[robot], active[robot], np.empty((slots, 2)), no_lines(slots)
        separate((points[robot], edge), q, target, parameters, half_spaces)
        coming = closing[robot], spans[robot]
        of_faces = move_half_spaces((echoes, beams), motion, pose, parameters, half_spaces, coming)
        assign_velocities(points[robot], scan, of_faces, tracks[robot], pose, parameters)
        bind_robots_without_beams(half_spaces, (poses, robots), parameters, binds[robot])
    used = 0
    for robot in range(len(points)):
        used = max(used, slots_used(points[robot]))
        for k in range(active.shape[1]):
            binds[robot, k, robot] = active[robot, k]
    return used


@kernel
def bind_robots_without_beams(half_spaces, team, parameters, binds):
    """Let long straight faces bind the robots that see nothing themselves, as walls bind the team of `scope: team`.

    `half_spaces` are those of `separate`; `team` poses (n, 3) and which robots have beams (R,); binds (K, n) is
    written. A robot that is behind the face already is on its other side, or beside it.
    """
    (G, h, active, _, lines), (poses, robots) = half_spaces, team
    for other in range(len(poses)):
        if (robots == other).any():
            continue
        x = poses[other, 0] + parameters.hand_offset * math.cos(poses[other, 2])
        y = poses[other, 1] + parameters.hand_offset * math.sin(poses[other, 2])
        for k in range(len(h)):
            behind = G[k, 0] * x + G[k, 1] * y > h[k] + parameters.clearance
            line = line_at(lines, k)
            binds[k, other] = active[k] and line.high - line.low >= parameters.long_extent and not behind


@kernel
def _copy(before, after):
    """Begin with what was known before; `after` (eight members, in their order) as for `perceive_points`."""
    points, used, anchors, past, past_poses, tracks, free, least = before
    copy_records(anchors, len(anchors), after[1])
    for robot in range(len(anchors)):
        copy_records(points[robot], used, after[0][robot])
        for scan in range(past.shape[1]):
            copy_records(past[robot, scan], past.shape[2], after[2][robot, scan])
        copy_records(past_poses[robot], past_poses.shape[1], after[3][robot])
        copy_records(tracks[robot], tracks.shape[1], after[4][robot])
    after[5][:], after[6][:] = free, least
