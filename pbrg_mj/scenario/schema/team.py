"""`team`: the robots at the start, their formation and their leaders."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pbrg_mj.scenario.schema.base import MOST_ROBOTS, Number, RobotNumber, Section, Vector

Scale = Annotated[float, Field(ge=0.5, le=2.0)]
Scales = Scale | tuple[Scale, ...]


class Variation(Section):
    """How the robots differ from their model in physics, one number for all or one per robot; unknown to the robots."""

    mass: Scales = Field(default=1.0, description="of body and wheels, with their inertia, per the model's [-]")
    motor_constant: Scales = Field(
        default=1.0, description="torque per current and back-EMF per speed, per the model's [-]"
    )
    wheel_radius: Scales = Field(default=1.0, description="of both wheels, per the model's [-]")
    friction: Scales = Field(default=1.0, description="of gears and bearings, per the model's [-]")


class Team(Section):
    """The robots: their number is the length of `start`."""

    start: tuple[Vector, ...] = Field(
        description="hand points q(0) in the world, one [x, y] per robot [m]", min_length=1, max_length=MOST_ROBOTS
    )
    heading_deg: Number | tuple[Number, ...] = Field(
        default=0.0, description="start headings [deg], one for all or one per robot, counter-clockwise from +x"
    )
    formation: tuple[Vector, ...] = Field(description="bias b_j of each robot from the reference [m]")
    variation: Variation = Variation()
    leaders: tuple[RobotNumber, ...] = Field(
        description="robots that receive the reference, counted from 1", min_length=1
    )
