"""A straight line through range points, with its covariance and how well it fits.

The line is n(theta) . p = c with n = (cos theta, sin theta) the normal away from the robot and c >= 0. Noise is
along the beams: a range error of variance sigma^2 gives the residual e_i = n . p_i - c the variance
(n . d_i)^2 sigma^2, d_i the beam's direction, and so its weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.points import Points

LEAST_COSINE = 0.1  # keeps the weight of a beam that runs along the line finite


@dataclass(frozen=True)
class Line:
    """A fitted line in the frame of its points."""

    angle: float  # theta, direction of the normal [rad]
    offset: float  # c [m]
    covariance: np.ndarray  # (2, 2) of (angle, offset)
    normal: np.ndarray  # (2,) n
    along: np.ndarray  # (N,) coordinate of each point along t = dn/dtheta [m]
    residual: np.ndarray  # (N,) distance of each point from the line [m]
    weight: np.ndarray  # (N,) 1 / (n . d_i)^2

    @property
    def middle(self) -> np.ndarray:
        """Return the middle of the points' span on the line, (2,) [m]."""
        tangent = np.array([-self.normal[1], self.normal[0]])
        return self.offset * self.normal + 0.5 * (self.along.min() + self.along.max()) * tangent

    @property
    def length(self) -> float:
        """Return the points' span along the line [m]."""
        return float(np.ptp(self.along))


def fit_line(points: Points, range_std: float, guess: np.ndarray | None = None) -> Line:
    """Return the weighted total-least-squares line of at least two different points (closed form).

    `range_std` sigma [m] sets the covariance, which holds to first order in the noise. `guess` (2,) is a normal good
    enough for the weights; without it the chord from the first to the last point gives one.
    """
    xy = points.xy_body
    weight = _weight(points.direction, _chord_normal(xy) if guess is None else guess)
    total = weight.sum()
    mean = weight @ xy / total
    off = xy - mean
    (sxx, sxy), (_, syy) = (off.T * weight) @ off
    # The scatter's longer axis is the line, the shorter one its normal.
    angle = 0.5 * math.atan2(2 * sxy, sxx - syy) + 0.5 * math.pi
    normal = np.array([math.cos(angle), math.sin(angle)])
    offset = float(normal @ mean)
    if offset < 0:
        angle, normal, offset = angle + math.pi, -normal, -offset
    along = xy @ np.array([-normal[1], normal[0]])
    weight = _weight(points.direction, normal)
    return Line(
        angle=math.remainder(angle, 2 * math.pi),
        offset=offset,
        covariance=_covariance(along, weight, range_std),
        normal=normal,
        along=along,
        residual=xy @ normal - offset,
        weight=weight,
    )


def _chord_normal(xy: np.ndarray) -> np.ndarray:
    x, y = xy[-1] - xy[0]
    length = math.hypot(x, y)
    return np.array([-y, x]) / length if length > 0 else np.array([1.0, 0.0])


def _weight(direction: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return 1 / np.maximum((direction @ normal) ** 2, LEAST_COSINE**2)


def _covariance(along: np.ndarray, weight: np.ndarray, range_std: float) -> np.ndarray:
    """Return sigma^2 times the inverse of sum w (s, -1)(s, -1)', since de/dtheta = s and de/dc = -1."""
    w, ws, wss = weight.sum(), weight @ along, weight @ along**2
    return range_std**2 / (w * wss - ws**2) * np.array([[w, ws], [ws, wss]])


def deviations(line: Line, range_std: float) -> np.ndarray:
    """Return (N,) residuals in their own standard deviations: N(0, 1) each for points of a straight wall."""
    s, w = line.along - line.weight @ line.along / line.weight.sum(), line.weight
    leverage = w * (1 / w.sum() + s**2 / (w @ s**2))
    return line.residual * np.sqrt(w / np.maximum(1 - leverage, 1e-6)) / range_std


def misfit(line: Line, range_std: float) -> float:
    """Return the weighted sum of squared residuals: chi-squared with N - 2 degrees for a straight wall."""
    return float(line.weight @ line.residual**2) / range_std**2


def bend(line: Line, range_std: float) -> float:
    """Return the line's curvature in its own standard deviations: N(0, 1) for a straight wall.

    The residuals are projected on s^2 made orthogonal to a line.
    """
    w, s = line.weight, line.along
    u = s - w @ s / w.sum()
    basis = u**2 - (w @ u**2) / w.sum() - (w @ u**3) / (w @ u**2) * u
    size = float(w @ basis**2)
    return float(w @ (basis * line.residual)) / (range_std * math.sqrt(size)) if size > 0 else 0.0
