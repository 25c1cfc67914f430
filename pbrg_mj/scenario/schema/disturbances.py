"""`disturbances`: pushes, dead motors, kidnapped robots."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pbrg_mj.scenario.schema.base import MOST_EVENTS, NonNegative, Number, Positive, RobotNumber, Section, Vector


class Push(Section):
    """A force on a robot's body, at its centre of mass; times are rounded up to whole physics steps."""

    robot: RobotNumber = Field(description="the robot pushed")
    time: NonNegative = Field(description="from when on [s]")
    duration: Positive = Field(description="for how long [s]")
    force: Vector = Field(description="in the world [N]")


class DeadMotor(Section):
    """A motor that gets no voltage: it brakes, as a shorted motor does."""

    robot: RobotNumber = Field(description="the robot concerned")
    side: Literal["left", "right"] = Field(description="which wheel")
    time: NonNegative = Field(description="from when on [s]")
    duration: Positive | None = Field(default=None, description="for how long [s]; null: for good")


class Kidnapping(Section):
    """A kidnapped robot: lifted straight up and, later, put down at rest elsewhere.

    While it is off the floor neither beams nor robots meet it, its own beams return nothing, its wheels stand still,
    and the camera does not see it: its pose reading stays that of the last frame before. Its true place in the plane is
    where it was lifted.
    """

    robot: RobotNumber = Field(description="the robot concerned")
    time: NonNegative = Field(description="when it is lifted [s]")
    duration: Positive = Field(default=1.0, description="until it is put down [s]")
    to: Vector = Field(description="hand point where it is put down [m]")
    heading_deg: Number = Field(default=0.0, description="heading it is put down with [deg]")


class Disturbances(Section):
    """What happens to the robots of the physics plant."""

    pushes: tuple[Push, ...] = Field(default=(), description="forces on robots", max_length=MOST_EVENTS)
    dead_motors: tuple[DeadMotor, ...] = Field(default=(), description="motors that fail", max_length=MOST_EVENTS)
    kidnappings: tuple[Kidnapping, ...] = Field(
        default=(), description="robots that are lifted and put down elsewhere", max_length=MOST_EVENTS
    )
