"""`drive` and `radio`: from wheel speeds to the motors, and how long a command takes to reach them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pbrg_mj.scenario.schema.base import NonNegative, Section


class Drive(Section):
    """From commanded wheel speeds to the motors."""

    kind: Literal["voltage", "speed_loop"] = Field(
        default="voltage", description="open-loop voltage as in the paper, or an on-board wheel-speed loop"
    )
    pwm_levels: Annotated[int, Field(ge=0, le=2**31)] = Field(
        default=0, description="duty cycles a motor driver can make each way, e.g. 255; 0: any voltage"
    )
    friction: NonNegative = Field(
        default=1.0, description="scale of the motors' static and Coulomb friction [-]; 0: none"
    )
    friction_compensation: bool = Field(
        default=False,
        description="add the voltage of the motors' Coulomb friction in the direction of the commanded speed; "
        "`voltage` only",
    )


class Radio(Section):
    """How long a command takes to a robot's motors, at most 10 s in all. Before the first one the motors get 0.

    Every command is delayed by itself, but commands arrive in the order in which they were sent: one that would
    overtake the one before arrives together with it, and takes its place.
    """

    delay: NonNegative = Field(default=0.0, description="constant part [s]")
    jitter: NonNegative = Field(default=0.0, description="largest of the random part, uniform from 0 [s]")
