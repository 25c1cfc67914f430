"""`sensors`: range beams and the overhead camera. SI units unless the key says otherwise."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from pbrg_mj.scenario.schema.base import NonNegative, Number, Positive, Probability, RobotNumber, Section

PRESETS: dict[str, dict[str, float | int]] = {
    "ideal": {"noise_std": 0.0},
    # The Robotarium simulator's range model: 3 % multiplicative noise, 3.5 % dropout, 1.4 % outliers.
    "robotarium": {"noise_std": 0.0, "noise_ratio": 0.03, "dropout": 0.035, "outliers": 0.014},
    # A ring of time-of-flight modules of the VL53L1X class: ST's data sheet states millimetre steps, a ranging error of
    # 20 mm in the dark (taken as two deviations at 1.5 m), 3.6 m on white and 1.7 m on dark targets, up to 30 Hz over
    # the whole range; here half of that. Its 27 degrees of view are not modelled: beams are thin. Nor are the first
    # 7 cm used, of which it could see 3 more: the robot itself is there.
    "tof_ring": {
        "count": 24,
        "range_max": 3.0,
        "rate_hz": 15.0,
        "noise_std": 0.008,
        "noise_ratio": 0.005,
        "quantum": 0.001,
        "dropout": 0.02,
        "outliers": 0.005,
    },
    # A small scanning lidar of the RPLIDAR A1 class: Slamtec's data sheet states 0.15 to 12 m on white targets (8 m
    # here), 360 samples a turn at 5.5 to 10 turns a second, better than 0.5 mm below 1.5 m and 1 % beyond (taken as
    # two deviations); its protocol counts quarters of a millimetre. The whole turn is seen in one instant here.
    "lidar": {
        "count": 360,
        "range_min": 0.15,
        "range_max": 8.0,
        "rate_hz": 8.0,
        "noise_std": 0.003,
        "noise_ratio": 0.005,
        "quantum": 0.00025,
        "dropout": 0.01,
        "outliers": 0.001,
    },
}
"""What a preset sets. Keys given beside it win."""
EARLIER_GENERIC = "none"
"""What `generic` was called in earlier logs: it has beams all the same."""


Deviation = Annotated[float, Field(ge=0, le=1000)]
"""Of noise: a sensor that errs by more than a kilometre, or three turns, says nothing."""

Bias = Annotated[float, Field(ge=-1000, le=1000)]
PerRobot = Bias | tuple[Bias, ...]
"""One for all robots, or one per robot."""

Low = Annotated[float, Field(ge=0.02, le=0.04)]
High = Annotated[float, Field(ge=0.045, le=0.053)]
"""Heights that beams may start from [m]: where a robot has tub and wheels, and where it has its plate, 1 mm from what
is open above and below. Lower than the wheels' axles, beams would meet the floor whenever a robot speeds up."""


class Beams(Section):
    """Range beams from the body's centre, counter-clockwise."""

    preset: Literal["generic", "ideal", "robotarium", "tof_ring", "lidar"] = Field(
        default="generic",
        description="generic: this page's defaults; else a known sensor, whose numbers stand in for them",
    )
    robots: Literal["all"] | tuple[RobotNumber, ...] = Field(default="all", description="robots that carry beams")
    count: Annotated[int, Field(ge=1, le=1080)] = Field(default=72, description="beams per robot")
    height: Low | High = Field(
        default=0.049, description="above the floor [m]; up to 0.04 they see tubs and wheels, the own too, above plates"
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
        default=0.0, description="constant error of all ranges, one for all robots or one per robot; never told [m]"
    )
    quantum: NonNegative = Field(default=0.0, description="ranges are whole multiples of this; 0: any range [m]")
    dropout: Probability = Field(default=0.0, description="probability that a beam returns nothing [-]")
    outliers: Probability = Field(
        default=0.0, description="probability that a beam returns anything between range_min and range_max [-]"
    )

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, keys: Any) -> Any:
        """Fill in the preset's values under the keys that are given."""
        if isinstance(keys, dict) and keys.get("preset") == EARLIER_GENERIC:
            keys = {**keys, "preset": "generic"}
        preset = PRESETS.get(str(keys.get("preset"))) if isinstance(keys, dict) else None
        return {**preset, **keys} if preset else keys


class Camera(Section):
    """Overhead camera that gives every robot its own pose; a kidnapped robot keeps the pose it was last seen at."""

    rate_hz: Positive = Field(default=30.0, description="frames per second [Hz]")
    position_std: Deviation = Field(default=0.001, description="standard deviation of x and y [m]")
    heading_std_deg: Deviation = Field(default=0.2, description="standard deviation of the heading [deg]")
    bias_x: PerRobot = Field(
        default=0.0, description="constant error of x, one for all robots or one per robot; never told [m]"
    )
    bias_y: PerRobot = Field(default=0.0, description="the same of y [m]")
    heading_bias_deg: PerRobot = Field(default=0.0, description="the same of the heading [deg]")
    delay: NonNegative = Field(
        default=0.0, description="from exposure to use, at most 10 s [s]; until then the start poses are known"
    )


class Sensors(Section):
    """Sensors of the physics plant. The ideal plant is seen exactly, at every tick."""

    beams: Beams = Beams()
    camera: Camera = Camera()
    noise_model: str = Field(
        default="standard", description="of beams and camera: standard, by the numbers above, or a plug-in's name"
    )
    noise_options: dict[str, Any] = Field(default={}, description="of a plug-in's noise model")


def per_robot(given: PerRobot, robots: int) -> tuple[float, ...]:
    """Return one number for each robot."""
    return given if isinstance(given, tuple) else (given,) * robots


def beam_angles(beams: Beams) -> np.ndarray:
    """Return the directions (count,) [rad] of the beams from straight ahead, counter-clockwise, ascending.

    A sweep of 360 degrees spreads them evenly round the circle, the first beam's direction being met again by the
    beam after the last. Any other sweep reaches from the first beam to the last inclusive. One beam is the first.
    """
    count, sweep = beams.count, np.deg2rad(beams.sweep_deg)
    gaps = count if beams.sweep_deg == 360 else max(count - 1, 1)
    return np.deg2rad(beams.start_deg) + sweep * np.arange(count) / gaps
