"""`team`: the robots at the start, their formation and their leaders."""

from __future__ import annotations

from pydantic import Field

from pbrg_mj.scenario.schema.base import MOST_ROBOTS, Number, RobotNumber, Section, Vector


class Team(Section):
    """The robots: their number is the length of `start`."""

    start: tuple[Vector, ...] = Field(
        description="hand points q(0) in the world, one [x, y] per robot [m]", min_length=1, max_length=MOST_ROBOTS
    )
    heading_deg: Number | tuple[Number, ...] = Field(
        default=0.0, description="start headings [deg], one for all or one per robot, counter-clockwise from +x"
    )
    formation: tuple[Vector, ...] = Field(description="bias b_j of each robot from the reference [m]")
    leaders: tuple[RobotNumber, ...] = Field(
        description="robots that receive the reference, counted from 1", min_length=1
    )
