"""`network`: delay, loss and outages of the messages between robots."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pbrg_mj.scenario.schema.base import LARGEST, MOST_EVENTS, NonNegative, Positive, Probability, RobotNumber, Section

Rounds = Annotated[int, Field(ge=0)]


class Link(Section):
    """A link between two robots that differs from the others."""

    robots: tuple[RobotNumber, RobotNumber] = Field(description="its two ends")
    delay_rounds: Rounds = Field(description="rounds from sending to use, both ways")


class Outage(Section):
    """A time during which a robot neither sends nor receives."""

    robot: RobotNumber = Field(description="the robot concerned")
    time: NonNegative = Field(description="from when on [s]")
    duration: Positive | None = Field(default=None, description="for how long [s]; null: for good")


class PreStabiliserNetwork(Section):
    """What happens to the p and xi that robots send their neighbours once a tick, for eq. 2."""

    delay_ticks: Rounds = Field(default=0, description="ticks from sending to use")
    jitter_ticks: Rounds = Field(
        default=0, description="a message takes up to this many ticks longer than the delay, all equally likely"
    )
    reordering: bool = Field(
        default=True, description="messages overtake one another under jitter; false: a link delivers them in order"
    )
    loss: Probability = Field(default=0.0, description="share of messages lost [-]; the last one received stays in use")
    loss_burst: Annotated[float, Field(ge=1, le=LARGEST)] | None = Field(
        default=None, description="mean length of a run of lost messages, in ticks [-]; null: losses are independent"
    )
    outages: tuple[Outage, ...] = Field(
        default=(), description="robots that neither send nor receive for a while", max_length=MOST_EVENTS
    )


class Network(Section):
    """What happens to the governor's messages on the links of the graph."""

    exchange: Literal["plain", "scattering"] = Field(
        default="plain", description="messages are estimates as in the paper, or wave variables (arXiv 1609.04666)"
    )
    impedance: Positive = Field(default=2.0, description="of the waves, for `exchange: scattering` [-]")
    delay_rounds: Rounds = Field(default=0, description="rounds from sending to use; waves need at least 1")
    links: tuple[Link, ...] = Field(default=(), description="links with a delay of their own")
    jitter_rounds: Rounds = Field(
        default=0,
        description="a message takes up to this many rounds longer than its link's delay, all equally likely",
    )
    reordering: bool = Field(
        default=True, description="messages overtake one another under jitter; false: a link delivers them in order"
    )
    loss: Probability = Field(default=0.0, description="share of messages lost [-]; the last one received stays in use")
    loss_burst: Annotated[float, Field(ge=1, le=LARGEST)] | None = Field(
        default=None, description="mean length of a run of lost messages, in rounds [-]; null: losses are independent"
    )
    reserve_rounds: Rounds | None = Field(
        default=None,
        description="waves sent ahead at the start for rounds in which none comes, for `exchange: scattering`; null: "
        "as many as `jitter_rounds` and `loss` use up in one of a thousand rounds",
    )
    outages: tuple[Outage, ...] = Field(
        default=(), description="robots that neither send nor receive for a while", max_length=MOST_EVENTS
    )
    pre_stabiliser: PreStabiliserNetwork = PreStabiliserNetwork()
    neighbour_timeout: Positive = Field(
        default=0.5, description="a neighbour counts as lost when nothing was received from it for this long [s]"
    )
