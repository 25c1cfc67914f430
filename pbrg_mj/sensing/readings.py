"""What the robots get to see: noisy poses and noisy scans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.sensing.pose_filter import FilterMemory


class Readings(NamedTuple):
    """Sensor readings after noise; the only view of the world that anything downstream has.

    `new_scan` is true in the first tick that shows a scan; `ranges` are NaN where a beam returned nothing
    (no hit, out of range, dropped).
    """

    body_pose: np.ndarray  # (n, 3) x, y [m], heading [rad] estimated
    ranges: np.ndarray  # (beam robots, beams) [m]
    new_scan: bool
    pose_frame: int  # frames behind body_pose; -1 before the first
    scan_frame: int
    pose_filter: FilterMemory | None = None  # of the filter that body_pose is of, if there is one
