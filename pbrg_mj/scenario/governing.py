"""How the team is governed: pre-stabiliser, network, distributed governor, centralized reference. SI units."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pbrg_mj.scenario.base import NonNegative, Positive, Probability, RobotNumber, Section

Rounds = Annotated[int, Field(ge=0)]


class Control(Section):
    """Pre-stabiliser (eq. 2)."""

    alpha_r: Positive = Field(default=1.0, description="gain of the leaders towards their governed reference [1/s]")
    leak: NonNegative = Field(
        default=0.0,
        description="dxi/dt = -L p - leak L xi: bounds xi behind stuck wheels; 0, the paper's: no bound [-]",
    )
    speed_limit: Positive | None = Field(
        default=None, description="of every robot's u, governed as an input constraint (eqs. 5-7) [m/s]; null: none"
    )
    speed_facets: Annotated[int, Field(ge=3, le=64)] = Field(
        default=8, description="sides of the regular polygon inside the disc of `speed_limit`"
    )


class Link(Section):
    """A link between two robots that differs from the others."""

    robots: tuple[RobotNumber, RobotNumber] = Field(description="its two ends")
    delay_rounds: Rounds = Field(description="rounds from sending to use, both ways")


class Silence(Section):
    """A robot that neither sends nor hears for a while."""

    robot: RobotNumber = Field(description="the robot concerned")
    time: NonNegative = Field(description="from when on [s]")
    duration: Positive | None = Field(default=None, description="for how long [s]; null: for good")


class Network(Section):
    """What happens to the governor's messages on the links of the graph."""

    exchange: Literal["plain", "scattering"] = Field(
        default="plain", description="messages are estimates as in the paper, or wave variables (arXiv 1609.04666)"
    )
    impedance: Positive = Field(default=2.0, description="of the waves, for `exchange: scattering` [-]")
    delay_rounds: Rounds = Field(default=0, description="rounds from sending to use; waves need at least 1")
    links: tuple[Link, ...] = Field(default=(), description="links with a delay of their own")
    loss: Probability = Field(default=0.0, description="share of messages lost [-]; the last one that came is held")
    loss_burst: Annotated[float, Field(ge=1)] | None = Field(
        default=None, description="mean length of a run of lost messages, in rounds [-]; null: losses are independent"
    )
    silences: tuple[Silence, ...] = Field(default=(), description="robots that fall silent")
    silent_after: Positive = Field(
        default=0.5, description="a neighbour that has not been heard for this long counts as lost [s]"
    )


class Governor(Section):
    """The reference governor."""

    kind: str = Field(
        default="distributed", description="distributed (the paper), centralized, none, or a registered name"
    )
    alpha: Positive = Field(default=2.0, description="gain of the distributed optimization [-]")
    rounds: Annotated[int, Field(ge=1)] = Field(default=10, description="communication rounds per tick")
    step: Positive | None = Field(
        default=None,
        description="step of one round [s]; default tick / rounds: the paper's algorithm in real time",
    )
    certificate: Literal["ball"] = Field(
        default="ball", description="how half-spaces and state become constraints (eq. 13)"
    )
    initial: Literal["zero", "start"] = Field(
        default="zero", description="first estimates: zero, or m_i = p_i(0), z_p = p(0), z_xi = 0"
    )
    multiplier_cap: Positive | None = Field(
        default=5.0,
        description="largest multiplier of a row [m]: where no reference is admissible, the least violation is sought "
        "instead of running away; null: none, as in the paper",
    )
    guard: bool = Field(
        default=False,
        description="apply no reference that the robots' own rows forbid, though the optimizer lags; not in the paper",
    )


class Reference(Section):
    """The centralized optimum beside the distributed answer; it is never fed back."""

    solver: Literal["clarabel", "cvxpy", "none"] = Field(
        default="clarabel", description="Clarabel on the small form, CVXPY as the readable oracle, or none"
    )
    period: Positive = Field(default=0.1, description="time between solves [s]; a whole number of ticks")
