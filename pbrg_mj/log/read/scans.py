"""The scans of a log, which the run as arrays leaves out: only pictures need them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from google.protobuf.message import DecodeError

from pbrg_mj.log.read.header import open_mcap
from pbrg_mj.log.read.mcap_records import DamageError, read_records
from pbrg_mj.log.schema.channels import scan_channel
from pbrg_mj.log.schema.message import NANOSECONDS, LogMessage


@dataclass(frozen=True)
class ScanSeries:
    """One robot's scans, in order."""

    time: np.ndarray  # (S,) [s]
    angles: np.ndarray  # (beams,) [rad] from straight ahead, counter-clockwise
    ranges: np.ndarray  # (S, beams) [m], NaN where a beam returned nothing


def read_scans(path: str | Path, robots: int) -> dict[int, ScanSeries]:
    """Return the scans of `robots` robots by robot, counted from 0; those without scans are left out.

    A damaged log yields what its leading whole chunks hold. Expects a log that `open_run` has read.
    """
    topics = {scan_channel(robot + 1): robot for robot in range(robots)}
    found: dict[int, list[LaserScan]] = {}
    with open_mcap(Path(path)) as (file, size):
        try:
            for item in read_records(file, size):
                if isinstance(item, LogMessage) and item.topic in topics:
                    found.setdefault(topics[item.topic], []).append(LaserScan.FromString(item.data))
        except (DamageError, DecodeError):
            pass  # open_run has reported it
    return {robot: _series(scans) for robot, scans in sorted(found.items())}


def _series(scans: list[LaserScan]) -> ScanSeries:
    first = scans[0]
    count = len(first.ranges)
    alike = [scan for scan in scans if len(scan.ranges) == count]
    return ScanSeries(
        time=np.array([scan.timestamp.seconds + scan.timestamp.nanos / NANOSECONDS for scan in alike]),
        angles=np.linspace(first.start_angle, first.end_angle, count),
        ranges=np.array([scan.ranges for scan in alike], dtype=float),
    )
