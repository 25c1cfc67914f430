"""What stands around the robots and what happens to them. SI units."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from pbrg_mj.scenario.base import NonNegative, Positive, RobotNumber, Section, Vector


class Wall(Section):
    """A straight wall: a box around the segment from -> to."""

    start: Vector = Field(alias="from", description="one end of the centre line [m]")
    end: Vector = Field(alias="to", description="the other end of the centre line [m]")
    thickness: Positive = Field(default=0.1, description="across the centre line [m]")
    height: Positive = Field(default=0.2, description="above the floor [m]")


class Box(Section):
    """A box that stands still: a convex obstacle."""

    center: Vector = Field(description="middle of its footprint [m]")
    size: tuple[Positive, Positive] = Field(description="length and width of its footprint [m]")
    angle_deg: float = Field(default=0.0, description="of its length [deg], counter-clockwise from +x")
    height: Positive = Field(default=0.2, description="above the floor [m]")

    def as_wall(self) -> Wall:
        """Return the wall that takes up the very same room."""
        (x, y), (length, width), turn = self.center, self.size, math.radians(self.angle_deg)
        dx, dy = length / 2 * math.cos(turn), length / 2 * math.sin(turn)
        ends = {"from": (x - dx, y - dy), "to": (x + dx, y + dy)}
        return Wall.model_validate({**ends, "thickness": width, "height": self.height})


class Stop(Section):
    """Where a moving box is at a time."""

    time: NonNegative = Field(description="when [s]")
    center: Vector = Field(description="middle of its footprint [m]")


class MovingBox(Section):
    """A box along the axes that is driven on straight lines between stops, whatever stands in its way.

    Beams see it and robots bump into it. It is no wall: the margin to walls and contacts with walls leave it out.
    """

    size: tuple[Positive, Positive] = Field(description="along x and along y [m]")
    stops: tuple[Stop, ...] = Field(
        description="where it is when; it rests before the first and after the last", min_length=1
    )
    height: Positive = Field(default=0.2, description="above the floor [m]")

    def at(self, stop: Stop) -> Box:
        """Return the box as it stands at a stop."""
        return Box(center=stop.center, size=self.size, height=self.height)


class Patch(Section):
    """A rectangular working area, along the axes, with a floor of its own; a later patch lies on earlier ones."""

    start: Vector = Field(alias="from", description="one corner [m]")
    end: Vector = Field(alias="to", description="the opposite corner [m]")
    friction: Positive = Field(default=1.0, description="sliding friction against the wheels [-]")
    rolling_resistance: NonNegative = Field(
        default=0.0, description="force that resists a rolling wheel, per force that presses it down [-]"
    )


class World(Section):
    """What stands around the robots."""

    walls: tuple[Wall, ...] = Field(default=(), description="straight walls")
    boxes: tuple[Box, ...] = Field(default=(), description="boxes that stand still")
    moving_boxes: tuple[MovingBox, ...] = Field(default=(), description="boxes that move")
    floor_friction: Positive = Field(default=1.0, description="sliding friction of the floor against the wheels [-]")
    rolling_resistance: NonNegative = Field(
        default=0.0, description="force that resists a rolling wheel, per force that presses it down [-]"
    )
    patches: tuple[Patch, ...] = Field(default=(), description="working areas with another floor")

    @property
    def obstacles(self) -> tuple[Wall, ...]:
        """All that stands still and must not be touched: the walls, then the boxes as walls."""
        return (*self.walls, *(box.as_wall() for box in self.boxes))


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


class Carry(Section):
    """A robot that is lifted straight up and, later, put down at rest elsewhere.

    While it is off the floor neither beams nor robots meet it, its own beams return nothing, its wheels stand still,
    and the camera does not see it: its pose reading stays that of the last frame before. Its true place in the plane is
    where it was lifted.
    """

    robot: RobotNumber = Field(description="the robot concerned")
    time: NonNegative = Field(description="when it is lifted [s]")
    duration: Positive = Field(default=1.0, description="until it is put down [s]")
    to: Vector = Field(description="hand point where it is put down [m]")
    heading_deg: float = Field(default=0.0, description="heading it is put down with [deg]")


class Disturbances(Section):
    """What happens to the robots of the physics plant."""

    pushes: tuple[Push, ...] = Field(default=(), description="forces on robots")
    dead_motors: tuple[DeadMotor, ...] = Field(default=(), description="motors that fail")
    carries: tuple[Carry, ...] = Field(default=(), description="robots that are carried away and put back")


class Drive(Section):
    """From wanted wheel speeds to the motors."""

    kind: Literal["voltage", "speed_loop"] = Field(
        default="voltage", description="open-loop voltage as in the paper, or an on-board wheel-speed loop"
    )
    pwm_levels: Annotated[int, Field(ge=0)] = Field(
        default=0, description="duty cycles a motor driver can make each way, e.g. 255; 0: any voltage"
    )
    friction: NonNegative = Field(
        default=1.0, description="scale of the motors' static and Coulomb friction [-]; 0: none"
    )


class Radio(Section):
    """How long a command takes to a robot's motors, at most 10 s in all. Before the first one the motors get 0.

    Every command is delayed by itself, but commands arrive in the order in which they were sent: one that would
    overtake the one before arrives together with it, and takes its place.
    """

    delay: NonNegative = Field(default=0.0, description="constant part [s]")
    jitter: NonNegative = Field(default=0.0, description="largest of the random part, uniform from 0 [s]")
