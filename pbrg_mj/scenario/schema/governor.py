"""`control`, `governor` and `reference`: pre-stabiliser, reference governor, centralized optimum."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from pbrg_mj.scenario.schema.base import NonNegative, Positive, Section

WITHOUT_GOVERNOR = ("none", "cbf", "potential_field")
"""Kinds that apply r as it comes; the last two filter velocities instead."""
MOST_ROUNDS = 10_000  # of a tick; in 10 ms, one message a microsecond, faster than any radio


class Control(Section):
    """Pre-stabiliser (eq. 2)."""

    alpha_r: Positive = Field(
        default=2.5,
        description="gain of the leaders towards their governed reference; the default is that of the paper's "
        "experiment, in the ideal plant that of its simulation, 1 [1/s]",
    )
    leak: NonNegative = Field(
        default=0.0,
        description="dxi/dt = -L p - leak L xi: bounds xi behind stuck wheels; 0, the paper's: no bound [-]",
    )
    speed_limit: Positive | None = Field(
        default=None,
        description="limit of every robot's ||u||, kept by the governor as an input constraint (eqs. 5-7) [m/s]; null: "
        "none",
    )
    speed_facets: Annotated[int, Field(ge=3, le=64)] = Field(
        default=8,
        description="sides of the polygon inside the disc of `speed_limit`, for rows that depend on direction",
    )
    separation: Literal["auto"] | Positive | None = Field(
        default="auto",
        description="least distance of two hand points, kept by filtering velocities [m]; auto: 0.22 with "
        "`governor.kind: certified` in physics, where bodies touch at 0.2 or less, else null: robots are no obstacles",
    )


class Nids(Section):
    """`optimizer: nids`."""

    step: Annotated[float, Field(gt=0, lt=1)] = Field(default=0.5, description="c of its gradient steps [-]")
    mixing: Annotated[float, Field(gt=0, le=1)] = Field(
        default=1.0, description="w lambda_max(L), w the weight of each neighbour [-]"
    )


class Admm(Section):
    """`optimizer: admm`."""

    penalty: Positive = Field(default=0.5, description="penalty c on the difference between neighbours [-]")


class FlowInM(Section):
    """`optimizer: flow_in_m`."""

    step: Positive = Field(default=0.25, description="h of its Euler steps, one each round [-]")
    gain: Positive = Field(default=1.0, description="of cost and rows against consensus [-]")
    augmentation: NonNegative = Field(default=1.0, description="k of the augmented multipliers [-]")


class Governor(Section):
    """The reference governor."""

    kind: str = Field(
        default="distributed",
        description="distributed (the paper), certified (recommended: applies verified references alone), rollout "
        "(likewise, "
        "messages do not grow with the team), centralized, none, cbf and potential_field (r as it comes, every "
        "robot's velocity filtered), or a plug-in's name",
    )
    options: dict[str, Any] = Field(default={}, description="of a plug-in's governor")
    alpha: Positive = Field(
        default=7.0,
        description="gain of the distributed optimization; the default is that of the paper's experiment, in the ideal "
        "plant that of its simulation, 2 [-]",
    )
    rounds: Annotated[int, Field(ge=1, le=MOST_ROUNDS)] = Field(default=10, description="communication rounds per tick")
    step: Positive | None = Field(
        default=None,
        description="step of one round [s]; default tick / rounds: the paper's algorithm in real time",
    )
    integration: Literal["explicit", "proximal"] = Field(
        default="explicit",
        description="a round of the paper's flow: explicit, an Euler step; proximal, with cost and the bend of the "
        "ball implicit, which converges up to a step that is known before a run (docs/theory.md)",
    )
    optimizer: Literal["flooding", "nids", "admm", "flow_in_m", "scalar", "paper_flow"] = Field(
        default="flooding",
        description="`kind: certified`: how the robots find a reference: flooding (leaders know all rows), or an "
        "optimizer, of whose answer the share is applied that all robots have verified",
    )
    nids: Nids = Nids()
    admm: Admm = Admm()
    flow_in_m: FlowInM = FlowInM()
    certificate: str = Field(
        default="ball",
        description="how half-spaces and state become constraints: ball (eq. 13), directional_ball, predictive, or a "
        "plug-in's name; `kind: certified` and `rollout` have predictive where none is named; with none, cbf and "
        "potential_field it constrains the centralized optimum alone, and another than ball is a warning",
    )
    certificate_options: dict[str, Any] = Field(default={}, description="of a plug-in's certificate")
    margin: NonNegative | None = Field(
        default=None,
        description="distance kept from every half-space by directional_ball, predictive and `kind: cbf` [m]; null: "
        "0.01 in "
        "physics, 0 in the ideal plant",
    )
    predicted_motion: Literal["kinematic", "motors"] = Field(
        default="kinematic",
        description="`certificate: predictive`: how the team is predicted: kinematic, velocities are those commanded; "
        "motors (physics; `kind: certified` by flooding, or centralized), behind the motors' lag and the mean delay of "
        "poses and commands",
    )
    speed_rows: bool = Field(
        default=True,
        description="`kind: certified` in physics: references advance only as fast as the wheels can follow over the "
        "whole prediction",
    )
    rollout_order: Annotated[int, Field(ge=1, le=20)] = Field(
        default=8,
        description="`kind: rollout`: rounds of a step of the prediction, the order of its polynomial; 1: Euler's, a "
        "tick each [-]",
    )
    barrier_gain: Positive = Field(
        default=1.0,
        description="`kind: cbf`: hand points approach a half-space at most at this times their distance to it [1/s]",
    )
    field_gain: Positive = Field(
        default=1e-3, description="`kind: potential_field`: eta of the repulsion from half-spaces [m^4/s]"
    )
    field_range: Positive = Field(
        default=0.5, description="`kind: potential_field`: half-spaces farther away do not repel [m]"
    )
    sight_rows: bool = Field(
        default=True,
        description="`kind: certified`: references advance only so far that no robot's predicted way is longer than "
        "its beams see",
    )
    initial: Literal["zero", "start"] = Field(
        default="zero", description="first estimates: zero, or m_i = p_i(0), z_p = p(0), z_xi = 0"
    )
    multiplier_cap: Literal["auto"] | Positive | None = Field(
        default="auto",
        description="largest multiplier of a row [m]: where no reference is admissible, the least violation is sought "
        "instead of running away; auto: from robots, leaders and `reference_range`, so that the penalty is exact; "
        "null: none, as in the paper",
    )
    reference_range: Positive = Field(
        default=5.0,
        description="a leader takes a reference farther from its p than this as the point so far on the way there [m]; "
        "certified by flooding and rollout: 20 m from the mean of p in physics, and this bounds their retreats",
    )
    guard: bool = Field(
        default=False,
        description="from earlier versions; true is refused: `kind: certified` with `optimizer: paper_flow` and "
        "`certificate: ball` is in its place",
    )
    backend: Literal["compiled", "numpy", "program"] = Field(
        default="compiled",
        description="of the distributed governor and of eq. 2: compiled kernels, the equations in plain NumPy, "
        "readable and slow, or the governor as a program that every robot runs, its messages carried as bytes",
    )

    @model_validator(mode="before")
    @classmethod
    def _certificate(cls, keys: Any) -> Any:
        """Fill in the certificate that goes with the kind where none is named."""
        certified = isinstance(keys, dict) and keys.get("kind") in ("certified", "rollout")
        return {"certificate": "predictive", **keys} if certified else keys


class Reference(Section):
    """The centralized optimum beside the distributed answer; it is never fed back."""

    solver: str = Field(
        default="clarabel",
        description="clarabel on the small form, cvxpy as the readable oracle, none, or a plug-in's name",
    )
    options: dict[str, Any] = Field(default={}, description="of a plug-in's solver")
    period: Positive = Field(default=0.1, description="time between solves [s]; a whole number of ticks")
