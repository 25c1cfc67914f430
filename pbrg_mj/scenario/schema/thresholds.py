"""`estimator.thresholds`: from which distances and angles on perception tells one thing from another.

Lengths that depend on the robot are in its clearances: how far its hand point keeps from faces, and half of the
narrowest gap that it passes, 0.1 m of the generic robot. Those that depend on walls are in metres. What depends on the
sensor has no key: it follows from the sensor's noise, beams and rate.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pbrg_mj.scenario.schema.base import NonNegative, Positive, Section

Angle = Annotated[float, Field(gt=0, lt=90)]  # [deg]


class Thresholds(Section):
    """When perception takes what it sees for one thing; the last four hold for points."""

    grazing_deg: Angle = Field(
        default=10.0,
        description="flattest angle at which beams are taken to meet a wall; at flatter ones they see gaps in it [deg]",
    )
    curve_least_deg: Angle = Field(
        default=5.0, description="segments of one curve turn by more than this, or else they are one wall [deg]"
    )
    curve_most_deg: Angle = Field(
        default=40.0, description="and by less than this, or else they are two walls at a corner [deg]"
    )
    direction_std_deg: Angle = Field(
        default=3.5, description="a wall's direction is surer than this, 1 in 16, or else it is no line [deg]"
    )
    oblique_deg: Angle = Field(
        default=35.0,
        description="a short line seen at more than this from its normal may be a row of robots: gaps are hidden [deg]",
    )
    collinear_deg: Angle = Field(
        default=10.0, description="segments that differ by more, noise apart, are not tried as one line [deg]"
    )
    corner_deg: Angle = Field(default=5.0, description="two lines meet in a corner at more than this [deg]")
    least_gap: Positive = Field(
        default=1.0,
        description="a line has a gap or an end where beams pass so much of it: half a robot's width [clearances]",
    )
    near_deg: Angle = Field(
        default=10.0, description="a line that differs from a track by less, and is outside its gate, denies it [deg]"
    )
    near_offset: Positive = Field(
        default=1.5, description="and is nearer to it than this: no robot fits between two walls so near [clearances]"
    )
    same_deg: NonNegative = Field(
        default=1.0,
        description="deviation of two tracks of one wall, however sure they are: no wall is straighter [deg]",
    )
    same_offset: NonNegative = Field(default=0.01, description="and of their distance [m]")
    free_gap: Positive = Field(
        default=1.5,
        description="two parts of a line, an end between, are one wall up to this gap: less than a robot [clearances]",
    )
    hidden_gap: Positive = Field(
        default=6.0, description="and where no end was seen, up to this gap: three robots hide as much [clearances]"
    )
    least_overlap: Positive = Field(
        default=1.0, description="a track is part of a longer line that shows so much of it [clearances]"
    )
    extent_margin: NonNegative = Field(
        default=0.5, description="beams so near to the end of what was seen tell nothing of a track [clearances]"
    )
    passed_by: Positive = Field(
        default=1.0,
        description="an echo so far behind a line passed it by, and so far before it something hid it [clearances]",
    )
    end_tolerance: NonNegative = Field(
        default=0.01, description="an end that moves by less, beside the pose's noise, has not moved: bodies tilt [m]"
    )
    end_uncertainty: Positive = Field(
        default=1.5, description="an end counts as no more uncertain than this: less than a robot is wide [clearances]"
    )
    outline_least_deg: Angle = Field(
        default=20.0, description="two faces of one obstacle turn by more than this, or else they are one [deg]"
    )
    outline_most_deg: Annotated[float, Field(gt=90, lt=180)] = Field(
        default=160.0, description="and by less than this: sharper wedges are two obstacles [deg]"
    )
    corner_reach: Positive = Field(
        default=2.0, description="faces meet so far inside what was seen of them, or twice that beyond it [clearances]"
    )
    corner_tolerance: NonNegative = Field(
        default=0.02, description="and each is so far behind the other's line: more than noise [m]"
    )
    face_depth: Positive = Field(
        default=3.0, description="what is behind a single face counts as solid so deep [clearances]"
    )
    team_gap: NonNegative = Field(
        default=0.5,
        description="an obstacle among robots is kept off all of them again from this gap on: hysteresis [clearances]",
    )
    slot_hysteresis: NonNegative = Field(
        default=1.0, description="an obstacle takes the slot of one that is farther by more than this [clearances]"
    )
    long_extent: Positive = Field(
        default=1.0, description="a line so long is a wall when it is seen twice: no thing that moves is [m]"
    )
    rest_speed: Positive = Field(default=0.1, description="what may be faster than this is not at rest [m/s]")
    joining: Positive = Field(
        default=2.0,
        description="echoes nearer to each other than this are of one thing: no robot passes between [clearances]",
    )
    straight_length: Positive = Field(
        default=2.5, description="points on a line at least so long are a straight face [clearances]"
    )
