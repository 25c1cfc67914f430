"""`sensors.camera`: poses from above, and what goes wrong with them."""

from __future__ import annotations

from pydantic import Field

from pbrg_mj.scenario.schema.base import (
    MOST_EVENTS,
    Deviation,
    NonNegative,
    PerRobot,
    Positive,
    Probability,
    RobotNumber,
    Section,
)


class Occlusion(Section):
    """The camera does not find a robot, whose pose reading keeps the last value."""

    robot: RobotNumber = Field(description="the robot concerned")
    time: NonNegative = Field(description="from which exposure on [s]; later than 0")
    duration: Positive = Field(description="for how long [s]")


class Swap(Section):
    """The camera exchanges the identities of two robots: each gets the other's pose."""

    robots: tuple[RobotNumber, RobotNumber] = Field(description="the two robots")
    time: NonNegative = Field(description="from which exposure on [s]")
    duration: Positive = Field(description="for how long [s]")


class Camera(Section):
    """Overhead camera that gives every robot its own pose; a kidnapped robot keeps the pose it was last seen at."""

    rate_hz: Positive = Field(default=30.0, description="frames per second [Hz]")
    position_std: Deviation = Field(default=0.001, description="standard deviation of x and y [m]")
    heading_std_deg: Deviation = Field(default=0.2, description="standard deviation of the heading [deg]")
    bias_x: PerRobot = Field(
        default=0.0, description="constant error of x, one for all robots or one per robot; unknown to them [m]"
    )
    bias_y: PerRobot = Field(default=0.0, description="the same of y [m]")
    heading_bias_deg: PerRobot = Field(default=0.0, description="the same of the heading [deg]")
    delay: NonNegative = Field(
        default=0.0, description="from exposure to use, at most 10 s [s]; until then the start poses are known"
    )
    lost_frames: Probability = Field(default=0.0, description="probability that a frame is lost, for all robots [-]")
    occlusions: tuple[Occlusion, ...] = Field(
        default=(),
        description="times in which the camera does not find a robot; robots are not informed",
        max_length=MOST_EVENTS,
    )
    swaps: tuple[Swap, ...] = Field(
        default=(),
        description="times in which it takes two robots for each other; robots are not informed",
        max_length=MOST_EVENTS,
    )
