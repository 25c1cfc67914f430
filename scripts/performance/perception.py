"""Perception: a set of scans of all robots to half-spaces."""

from __future__ import annotations

from perception_time import DEFAULT, time_scans


def perception() -> dict[str, dict[str, float]]:
    """Return the median time of a set of scans [us] in each of the default scenes."""
    found = {name: time_scans(name) for name in DEFAULT}
    return {name: {"scans": scans, "beams": beams, "us": 1e6 * time} for name, (scans, beams, time) in found.items()}
