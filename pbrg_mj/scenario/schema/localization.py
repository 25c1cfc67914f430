"""`sensors.uwb` and `sensors.odometry`: poses beside, or in place of, the overhead camera's."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from pbrg_mj.scenario.schema.base import Deviation, NonNegative, Probability, Section, Vector


class UltraWideband(Section):
    """Radio ranges to anchors, from which x and y are found in place of the camera's, at its rate and with its delay.

    The heading stays the camera's.
    """

    anchors: tuple[Vector, ...] = Field(
        default=(), description="places of the anchors, three or more and not on one line; none: no such radio [m]"
    )
    range_std: Deviation = Field(default=0.05, description="standard deviation of a range in line of sight [m]")
    late_share: Probability = Field(default=0.1, description="share of ranges whose direct path is lost [-]")
    late_mean: NonNegative = Field(
        default=0.3, description="mean of the additional exponential error of such a range, always too long [m]"
    )

    def position_std(self) -> float:
        """Return the standard deviation of x and y [m] amid the anchors, of ranges in line of sight."""
        anchors = np.array(self.anchors)
        ray = anchors - anchors.mean(axis=0)
        ray = ray / np.maximum(np.linalg.norm(ray, axis=1), 1e-9)[:, None]
        return float(self.range_std * np.sqrt(np.trace(np.linalg.inv(ray.T @ ray)) / 2.0))


class Odometry(Section):
    """Wheel encoders, which an extended Kalman filter fuses with the camera's poses."""

    fuse: bool = Field(default=False, description="false: robots use the camera's last pose alone")
    steps_per_turn: Annotated[int, Field(ge=4, le=10**6)] = Field(
        default=4096, description="steps of a wheel's encoder in one turn"
    )
    slip: Annotated[float, Field(ge=1e-9, le=1.0)] = Field(
        default=1e-4, description="variance of a wheel's travel that the filter assumes, per metre travelled [m]"
    )
