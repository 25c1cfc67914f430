"""`estimator`: from scans to half-spaces."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from pbrg_mj.scenario.schema.assumed import Assumed
from pbrg_mj.scenario.schema.base import MOST_EVENTS, NonNegative, Number, Positive, RobotNumber, Section, Vector
from pbrg_mj.scenario.schema.thresholds import Thresholds

POINTS = {"scope": "own", "half_spaces_per_robot": 8}
"""What `source: points` sets. Keys given beside it win."""


class GivenHalfSpace(Section):
    """A half-space normal . q <= offset that one robot knows from the start."""

    robot: RobotNumber = Field(description="the robot that knows it")
    normal: Vector = Field(description="outward normal, of any length but zero [-]")
    offset: Number = Field(
        description="right-hand side of normal . q <= offset [m], with the normal as long as it is given"
    )


class Estimator(Section):
    """From scans to half-spaces."""

    source: str = Field(
        default="beams",
        description="beams: lines are fitted to them; points: single echoes, from obstacles of any shape, with `scope: "
        "own`; given: "
        "`given` as it is; or a plug-in's name",
    )
    options: dict[str, Any] = Field(default={}, description="of a plug-in's estimator")
    given: tuple[GivenHalfSpace, ...] = Field(
        default=(), description="the half-spaces for `source: given`", max_length=MOST_EVENTS
    )
    half_spaces_per_robot: Annotated[int, Field(ge=1, le=16)] = Field(
        default=4, description="most half-spaces a robot holds"
    )
    min_points: Annotated[int, Field(ge=3, le=1080)] = Field(
        default=5, description="fewest beams that make a line; more where the views of cones overlap"
    )
    split_distance: Positive = Field(
        default=0.03, description="largest distance of a point from a line; beyond it the line is split [m]"
    )
    min_length: Positive = Field(default=0.25, description="shortest run of points that counts as a wall [m]")
    sigmas: NonNegative = Field(
        default=3.0, description="half-spaces move inward by this many standard deviations of the wall's place [-]"
    )
    scope: Literal["team", "own"] = Field(
        default="team",
        description="which robots a half-space binds: every robot, as in the paper, or the one that sees it",
    )
    unknown: Literal["free", "closed", "strict"] = Field(
        default="free",
        description="`source: points`: free: space without echoes is free; closed: robots do not enter space that "
        "no beam has shown to be free: behind obstacles, beyond the beams' range, on blind sides; strict: nor space "
        "that a beam without echo may have passed, unless echoes are on both sides",
    )
    memory: NonNegative = Field(default=10.0, description="how long a wall out of sight is kept [s]")
    drift_std: NonNegative = Field(
        default=0.005, description="growth of an unseen wall's offset uncertainty [m], per square root of a second"
    )
    drift_std_deg: NonNegative = Field(
        default=0.2, description="growth of an unseen wall's angle uncertainty [deg], per square root of a second"
    )
    assumed: Assumed = Assumed()
    thresholds: Thresholds = Thresholds()

    @model_validator(mode="before")
    @classmethod
    def _points(cls, keys: Any) -> Any:
        """Fill in what goes with points where it is not given."""
        points = isinstance(keys, dict) and keys.get("source") == "points"
        return {**POINTS, **keys} if points else keys
