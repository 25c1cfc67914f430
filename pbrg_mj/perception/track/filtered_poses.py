"""How much the poses of a filter are worth where scan after scan is averaged.

The error of a filter's pose lasts: a frame corrects the share K of it, K = P / R with P the filter's variance after a
frame and R the frame's. From scan to scan its correlation is rho = (1 - K)^m, m the frames between two scans, and the
mean of N such errors has the variance P (1 + rho) / (1 - rho) / N for a large N: that of independent errors of

    V = P (1 + rho) / (1 - rho),    with a frame at every scan V = R (2 - K).

Where frames are rarer than scans, rho = 1 - K is from frame to frame, and the scans between two frames count as one.
P is the filter's own variance at the scan, slip of the wheels since the last frame included.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.perception.track.world_frame import PoseModel


def equivalent_variances(at_frame: np.ndarray, now: np.ndarray, model: PoseModel) -> np.ndarray:
    """Return V (n, 2) of x and y each [m^2] and of the heading [rad^2].

    `at_frame` and `now` (n, 3, 3) are the filter's covariances of x, y, heading after the last frame and at the scan.
    """
    camera = np.array([model.position_var, model.heading_var]) / model.shared
    gain = np.clip(_variances(at_frame) / np.maximum(camera, np.finfo(float).tiny), 1e-3, 1.0)
    kept = (1.0 - gain) ** max(model.scan_period / model.frame_period, 1.0)
    return model.shared * _variances(now) * (1.0 + kept) / (1.0 - kept)


def _variances(covariance: np.ndarray) -> np.ndarray:
    """Return the variances (n, 2) of a place, the mean of both axes, and of the heading."""
    place = 0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1])
    return np.column_stack([place, covariance[:, 2, 2]])
