"""What goes wrong with the camera's poses: lost frames, robots that it does not find, robots that it mixes up."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.scenario.random_streams import Source, Streams
from pbrg_mj.scenario.schema import Scenario


class CameraFaults(NamedTuple):
    """Faults of a run. Times are those of a frame's exposure."""

    lost_frames: float  # probability
    hidden: tuple[tuple[int, float, float], ...]  # robot from 0, from when until when [s]
    swapped: tuple[tuple[int, int, float, float], ...]  # two robots from 0, from when until when [s]
    period: float  # of the frames [s]

    def is_lost(self, frame: int, seed: int) -> bool:
        """Tell whether a frame is lost, for all robots. The first one never is: it tells where robots start."""
        if self.lost_frames == 0.0 or frame == 0:
            return False
        return bool(Streams(seed, Source.LOST_FRAMES).at(0, frame).random() < self.lost_frames)

    def applied(self, poses: np.ndarray, before: np.ndarray | None, frame: int) -> np.ndarray:
        """Return the poses (n, 3) that the camera reports, from those of a frame and those reported before, or None."""
        time, reported = frame * self.period, poses.copy()
        for one, other, start, end in self.swapped:
            if start <= time < end:
                reported[[one, other]] = reported[[other, one]]
        for robot, start, end in self.hidden:
            if start <= time < end and before is not None:
                reported[robot] = before[robot]
        return reported


def camera_faults(scenario: Scenario) -> CameraFaults | None:
    """Return the faults of a scenario's camera, None for none."""
    camera, step = scenario.sensors.camera, scenario.timing.physics_step
    if scenario.plant == "ideal" or not (camera.lost_frames or camera.occlusions or camera.swaps):
        return None
    return CameraFaults(
        lost_frames=camera.lost_frames,
        hidden=tuple((one.robot - 1, one.time, one.time + one.duration) for one in camera.occlusions),
        swapped=tuple((s.robots[0] - 1, s.robots[1] - 1, s.time, s.time + s.duration) for s in camera.swaps),
        period=max(1.0 / camera.rate_hz, step),
    )
