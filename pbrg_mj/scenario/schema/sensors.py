"""`sensors`: range beams and the overhead camera. SI units unless the key says otherwise."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from pbrg_mj.scenario.schema.base import (
    Deviation,
    NonNegative,
    Number,
    PerRobot,
    Positive,
    Probability,
    RobotNumber,
    Section,
)
from pbrg_mj.scenario.schema.beam_presets import PRESETS
from pbrg_mj.scenario.schema.camera import Camera
from pbrg_mj.scenario.schema.localization import Odometry, UltraWideband

EARLIER_GENERIC = "none"
"""What `generic` was called in earlier logs: it has beams all the same."""


Low = Annotated[float, Field(ge=0.02, le=0.04)]
High = Annotated[float, Field(ge=0.045, le=0.053)]
"""Heights that beams may start from [m]: where a robot has tub and wheels, and where it has its plate, 1 mm from what
is open above and below. Lower than the wheels' axles, beams would meet the floor whenever a robot speeds up."""


class Beams(Section):
    """Range beams from the body's centre, counter-clockwise."""

    preset: Literal["generic", "ideal", "robotarium", "tof_ring", "tof_cones", "lidar", "lds_02"] = Field(
        default="generic",
        description="generic: the defaults of this page; else a known sensor, whose values replace them",
    )
    robots: Literal["all"] | tuple[RobotNumber, ...] = Field(default="all", description="robots that carry beams")
    count: Annotated[int, Field(ge=1, le=1080)] = Field(default=72, description="beams per robot")
    height: Low | High = Field(
        default=0.049,
        description="above the floor [m]; up to 0.04 beams meet the robots' tubs and wheels, their own too, above that "
        "their plates",
    )
    range_min: NonNegative = Field(default=0.07, description="shortest range reported [m]")
    range_max: Positive = Field(default=4.0, description="longest range reported [m]")
    rate_hz: Positive = Field(default=10.0, description="scans per second [Hz]")
    start_deg: Number = Field(default=0.0, description="direction of the first beam from straight ahead [deg]")
    sweep_deg: Annotated[float, Field(gt=0, le=360)] = Field(
        default=360.0, description="from the first beam to the last [deg]; 360: evenly round the circle"
    )
    noise_std: Deviation = Field(default=0.005, description="standard deviation of additive Gaussian range noise [m]")
    noise_ratio: Deviation = Field(default=0.0, description="standard deviation of range noise per range [-]")
    bias: PerRobot = Field(
        default=0.0,
        description="constant error of all ranges, one for all robots or one per robot; unknown to them [m]",
    )
    quantum: NonNegative = Field(default=0.0, description="ranges are whole multiples of this; 0: any range [m]")
    dropout: Probability = Field(default=0.0, description="probability that a beam returns nothing [-]")
    outliers: Probability = Field(
        default=0.0, description="probability that a beam returns anything between range_min and range_max [-]"
    )

    beam_bias_std: Deviation = Field(
        default=0.0,
        description="standard deviation of a constant error of each beam, drawn once a run; unknown to the robots [m]",
    )
    cone_deg: Annotated[float, Field(ge=0, le=60)] = Field(
        default=0.0, description="width of the horizontal fan in which a beam sees the nearest object [deg]; 0: a ray"
    )
    cone_rays: Annotated[int, Field(ge=2, le=31)] = Field(
        default=9, description="rays that represent the fan, evenly from edge to edge"
    )
    signal_range: Positive | None = Field(
        default=None,
        description="range at which a white wall head-on (0.88 of the light comes back) gives an echo every other time "
        "[m]; nearer if it is oblique; null: what is hit gives an echo",
    )
    signal_spread: Deviation = Field(
        default=0.1, description="standard deviation of the power that comes back, relative [-]"
    )
    scan_time: Annotated[float, Field(ge=0, le=10)] = Field(
        default=0.0, description="time from the first beam of a scan to the last [s]; 0: all at once"
    )

    @property
    def rays(self) -> int:
        """How many rays stand for a beam."""
        return self.cone_rays if self.cone_deg > 0 else 1

    @property
    def all_rays(self) -> int:
        """How many rays stand for all beams of a robot."""
        return self.count * self.rays

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, keys: Any) -> Any:
        """Fill in the preset's values under the keys that are given."""
        if isinstance(keys, dict) and keys.get("preset") == EARLIER_GENERIC:
            keys = {**keys, "preset": "generic"}
        preset = PRESETS.get(str(keys.get("preset"))) if isinstance(keys, dict) else None
        return {**preset, **keys} if preset else keys


class Sensors(Section):
    """Sensors of the physics plant. The ideal plant is seen exactly, at every tick."""

    beams: Beams = Beams()
    camera: Camera = Camera()
    uwb: UltraWideband = UltraWideband()
    odometry: Odometry = Odometry()
    noise_model: str = Field(
        default="standard", description="noise of beams and camera: standard, by the numbers above, or a plug-in's name"
    )
    noise_options: dict[str, Any] = Field(default={}, description="of a plug-in's noise model")


def beam_angles(beams: Beams) -> np.ndarray:
    """Return the directions (count,) [rad] of the beams from straight ahead, counter-clockwise, ascending.

    A sweep of 360 degrees spreads them evenly round the circle, the first beam's direction being met again by the
    beam after the last. Any other sweep reaches from the first beam to the last inclusive. One beam is the first.
    """
    count, sweep = beams.count, np.deg2rad(beams.sweep_deg)
    gaps = count if beams.sweep_deg == 360 else max(count - 1, 1)
    return np.deg2rad(beams.start_deg) + sweep * np.arange(count) / gaps


def ray_angles(beams: Beams) -> np.ndarray:
    """Return the directions (count * rays,) [rad] of all rays: those of the first beam's cone, edge to edge, first."""
    if beams.rays == 1:
        return beam_angles(beams)
    across = np.deg2rad(beams.cone_deg) * np.linspace(-0.5, 0.5, beams.rays)
    return (beam_angles(beams)[:, None] + across).ravel()
