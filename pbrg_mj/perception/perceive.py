"""One tick of perception: scans to lines to tracks to half-spaces."""

from __future__ import annotations

import numpy as np

from pbrg_mj.perception.frames import STAND
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.memory import PerceptionMemory
from pbrg_mj.perception.scans import perceive_scans
from pbrg_mj.perception.setup import PerceptionSetup
from pbrg_mj.perception.tracks import no_tracks
from pbrg_mj.sensing.readings import Readings


def initial(setup: PerceptionSetup) -> PerceptionMemory:
    """Return the memory before the first tick: the given half-spaces, or none."""
    known = setup.given or HalfSpaces.empty(setup.robots, setup.slots)
    return PerceptionMemory(no_tracks(setup.robots, setup.slots), np.zeros(setup.robots, dtype=STAND), known)


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
    known = HalfSpaces.empty(setup.robots, setup.slots)
    tracks, stands = np.empty(memory.tracks.shape, memory.tracks.dtype), np.empty_like(memory.stands)
    scans = (readings.ranges, readings.body_pose, readings.pose_frame, readings.scan_frame, time)
    written = (tracks, stands, known.G, known.h, known.active, known.binds)
    perceive_scans(scans, setup.plain, (memory.tracks, memory.stands), written)
    return known, PerceptionMemory(tracks, stands, known)
