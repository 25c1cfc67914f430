"""One tick of perception: scans to lines to tracks to half-spaces."""

from __future__ import annotations

import numpy as np

from pbrg_mj.perception.follow import follow
from pbrg_mj.perception.frames import ScanPose, stand, stood
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.memory import PerceptionMemory
from pbrg_mj.perception.scan_lines import scan_lines
from pbrg_mj.perception.separate import Stance
from pbrg_mj.perception.setup import PerceptionSetup
from pbrg_mj.perception.slots import fill
from pbrg_mj.perception.tracks import no_tracks
from pbrg_mj.perception.view import view
from pbrg_mj.sensing.readings import Readings


def initial(setup: PerceptionSetup) -> PerceptionMemory:
    """Return the memory before the first tick: the given half-spaces, or none."""
    known = setup.given or HalfSpaces.empty(setup.robots, setup.slots)
    return PerceptionMemory(no_tracks(setup.robots, setup.slots), (None,) * setup.robots, known)


def perceive(
    readings: Readings, time: float, memory: PerceptionMemory, setup: PerceptionSetup
) -> tuple[HalfSpaces, PerceptionMemory]:
    """Return the half-spaces every robot knows at `time` [s], for hand points in the world, and the new memory.

    They change with a new scan only. A half-space is a wall as followed over time, moved towards the robots by the
    clearance and `sigmas` standard deviations: a robot nearer to the wall than that lies outside its own
    half-space, and the caller sees it so.
    """
    if setup.given is not None or not readings.new_scan:
        return memory.half_spaces, memory
    tracks, stands = memory.tracks.copy(), list(memory.stands)
    known = HalfSpaces.empty(setup.robots, setup.slots)
    frames = (readings.pose_frame, readings.scan_frame)
    for ranges, robot in zip(readings.ranges, setup.beam_robots, strict=True):
        estimate = readings.body_pose[robot]
        if np.isnan(estimate).any():
            continue  # a robot that does not know where it is cannot place a wall
        pose = stand(estimate, frames, time, stands[robot], setup.pose)
        stands[robot] = stood(pose, estimate, frames[0], setup.pose)
        lines = scan_lines(ranges, setup.directions, setup.rules)
        follow(tracks[robot], view(lines, ranges, setup.directions, pose), setup.track_rules)
        _half_spaces(known, robot, tracks[robot], pose, setup)
    return known, PerceptionMemory(tracks, tuple(stands), known)


def _half_spaces(
    known: HalfSpaces, robot: int, tracks: np.ndarray, pose: ScanPose, setup: PerceptionSetup
) -> None:
    """Write the half-spaces of one robot's tracks into its slots."""
    x, y, heading = pose.pose
    hand = setup.hand_offset * np.array([[np.cos(heading), np.sin(heading)]])
    stance = Stance(setup.teams[robot] + hand, hand, pose.position_var, pose.heading_var)
    active = fill(tracks, stance, setup.track_rules, known.G[robot], known.h[robot])
    known.h[robot] += known.G[robot] @ np.array([x, y])
    known.active[robot] = active
    known.binds[robot] = active[:, None] & setup.binds[robot]
