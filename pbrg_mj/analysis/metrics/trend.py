"""Where a team is going: the trend of its distance to a target over the last seconds.

The window is split into thirds. Distances have a trend when no distance in the last third reaches one in the first, so
that what oscillates, or hunts, has none, and when the median fell from the middle third to the last, so that what has
stopped has none. How long an approach would take is extrapolated from the thirds' means d1, d2, d3, which of an
exponential approach d = limit + A exp(-t / tau) are an exponential too: with q = (d2 - d3) / (d1 - d2),

    tau = window / 3 / ln(1 / q),    limit = d3 - (d2 - d3) q / (1 - q)

(Aitken's extrapolation; exact for such an approach). Where tau is longer than the window, a team that slows down cannot
be told from one that does not, and small errors of q are large ones of the limit: its speed is taken to last, which
gives the earliest arrival.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

Direction = Literal["closing in", "receding", "circling", "standing", "wandering"]
MAX_APPROACH_RATIO = math.exp(-1 / 3)  # q of an approach whose time constant is the window
RETURN_SHARE = 0.25  # of the farthest distance from its last place: nearer than this, a robot has returned


@dataclass(frozen=True)
class Trend:
    """What the last seconds show of a team's way to a target."""

    direction: Direction
    rate: float  # at which the distance fell in the last third; negative: grew [m/s]
    limit: float  # distance at which an approach that slows down would end; NaN unless it does [m]
    arrival: float  # time at which the distance would be the tolerance; inf: never, NaN: not closing in [s]
    extent: float  # largest distance of a robot from its mean place [m]


def extent_of(place: np.ndarray) -> float:
    """Return the largest distance of a robot from its mean place [m]; `place` (W, n, 2) [m]."""
    return float(np.linalg.norm(place - place.mean(axis=0), axis=-1).max())


def trend(time: np.ndarray, place: np.ndarray, distance: np.ndarray, speed: float, tolerance: float) -> Trend:
    """Return the trend over a window of ticks at `time` (W,) [s], three or more.

    `place` (W, n, 2) are the robots' places and `distance` (W,) the team's distance from the target [m]. A change
    slower than `speed` [m/s] counts as none. Robots that stay within `tolerance` [m] of their mean place stand; they
    circle when one of them went farther than that from its last place and had been there before.
    """
    count = len(time) // 3
    first, middle, last = distance[-3 * count :].reshape(3, count)
    step, least = time[-1] - time[-1 - count], speed * (time[-1] - time[-1 - count])
    late = float(np.median(middle) - np.median(last))
    extent = extent_of(place)
    rate = -_slope(time[-count:], last)
    limit = arrival = math.nan
    if first.min() - last.max() >= least and late >= least:
        direction: Direction = "closing in"
        limit, arrival = _extrapolated(
            (first.mean(), middle.mean(), last.mean()), step, tolerance, (time[-1], distance[-1])
        )
    elif last.min() - first.max() >= least and -late >= least:
        direction = "receding"
    elif _returned(place, tolerance):
        direction = "circling"
    else:
        direction = "standing" if extent <= tolerance else "wandering"
    return Trend(direction, rate, limit, arrival, extent)


def _extrapolated(
    means: tuple[float, float, float], step: float, tolerance: float, end: tuple[float, float]
) -> tuple[float, float]:
    """Return the distance at which the approach ends, NaN if it does not slow down, and when it would arrive."""
    (d1, d2, d3), (now, left) = means, end
    early, late = d1 - d2, d2 - d3
    if left <= tolerance:
        return math.nan, now
    if late <= 0:  # it had come closer before, and stopped
        return d3, math.inf
    q = late / early if early > 0 else math.inf
    if q > MAX_APPROACH_RATIO:
        return math.nan, now + (left - tolerance) * step / late
    limit, tau = max(0.0, d3 - late * q / (1 - q)), step / math.log(1 / q)
    if limit >= tolerance:
        return limit, math.inf
    return limit, now + tau * math.log((left - limit) / (tolerance - limit))


def _returned(place: np.ndarray, least: float) -> bool:
    """Whether some robot was far from its last place, farther than `least`, and before that near it."""
    apart = np.linalg.norm(place - place[-1], axis=-1)  # (W, n)
    nearest_before = np.minimum.accumulate(apart, axis=0)
    return bool(np.any((apart > least) & (nearest_before < RETURN_SHARE * apart)))


def _slope(time: np.ndarray, values: np.ndarray) -> float:
    centred = time - time.mean()
    return float(centred @ values / (centred @ centred)) if len(time) > 1 else math.nan
