"""Consecutive points that may lie on one surface, by an adaptive breakpoint.

A wall met at a grazing angle `GRAZING` spreads neighbouring points r sin(dphi) / sin(GRAZING - dphi) apart, r the
shorter range and dphi the angle between the beams; points farther apart than that belong to different things
(Borges and Aldon, "Line extraction in 2D range images for mobile robotics", 2004).
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.perception.points import Points

GRAZING = np.deg2rad(15.0)
MAX_STEP = 3  # beams from one point to the next: up to two lost in between do not cut a wall
NOISE_MARGIN = 3.0 * np.sqrt(2.0)  # three standard deviations of a difference of two ranges


def cluster(points: Points, range_std: float) -> tuple[Points, list[tuple[int, int]], bool]:
    """Return the points turned so that no cluster wraps, the clusters as (start, stop), and whether they form a ring.

    In a ring no neighbours are apart: everything around is one cluster, whose last point is next to its first. It is
    then cut at the point farthest away, which is a corner if there is any.
    """
    count = len(points)
    if count == 0:
        return points, [], False
    apart = _apart_from_next(points, range_std)
    breaks = np.flatnonzero(apart)
    first = int(np.argmax(points.range)) if len(breaks) == 0 else (int(breaks[-1]) + 1) % count
    turned = points.take((np.arange(count) + first) % count)
    stops = np.sort((breaks - first) % count) + 1 if len(breaks) else np.array([count])
    starts = np.concatenate([[0], stops[:-1]])
    return turned, list(zip(starts.tolist(), stops.tolist(), strict=True)), len(breaks) == 0


def _apart_from_next(points: Points, range_std: float) -> np.ndarray:
    """Return (N,) bool: point i and the next one round the circle belong to different things."""
    after = np.arange(1, len(points) + 1) % len(points)
    step = (points.beam[after] - points.beam) % points.beams
    step[step == 0] = points.beams  # a lone point is a full circle from itself
    angle = 2 * np.pi * step / points.beams
    # Beams farther apart than the grazing angle say nothing about a surface between them: no limit.
    spread = np.sin(angle) / np.sin(np.maximum(GRAZING - angle, 1e-9))
    limit = np.minimum(points.range, points.range[after]) * spread + NOISE_MARGIN * range_std
    across = points.xy_body[after] - points.xy_body
    gap = np.hypot(across[:, 0], across[:, 1])
    return (step > MAX_STEP) | (gap > limit)
