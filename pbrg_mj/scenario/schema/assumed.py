"""`estimator.assumed`: what perception takes the sensors' errors for. By default that is what they are."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from pbrg_mj.scenario.schema.base import Deviation, NonNegative, Probability, Section
from pbrg_mj.scenario.schema.sensors import Sensors


class AssumedBeams(Section):
    """Errors that perception assumes of the beams; null: as in `sensors.beams`. No bias is ever assumed."""

    noise_std: Deviation | None = Field(default=None, description="standard deviation of additive range noise [m]")
    noise_ratio: Deviation | None = Field(default=None, description="standard deviation of range noise per range [-]")
    quantum: NonNegative | None = Field(default=None, description="step of the ranges [m]")
    dropout: Probability | None = Field(default=None, description="probability that a beam returns nothing [-]")
    outliers: Probability | None = Field(
        default=None, description="probability that a beam returns anything between range_min and range_max [-]"
    )
    cone_deg: Annotated[float, Field(ge=0, le=60)] | None = Field(
        default=None,
        description="width of the horizontal fan in which a beam sees the nearest object [deg]",
    )
    scan_time: Annotated[float, Field(ge=0, le=10)] | None = Field(
        default=None, description="time from the first beam of a scan to the last [s]"
    )


class AssumedCamera(Section):
    """Errors that perception assumes of the camera; null: as in `sensors.camera`. No bias is ever assumed."""

    position_std: Deviation | None = Field(default=None, description="standard deviation of x and y [m]")
    heading_std_deg: Deviation | None = Field(default=None, description="standard deviation of the heading [deg]")
    delay: NonNegative | None = Field(
        default=None, description="from exposure to use [s]: a pose counts as so much older than its arrival"
    )


class Assumed(Section):
    """What perception assumes of the sensors, right or wrong."""

    beams: AssumedBeams = AssumedBeams()
    camera: AssumedCamera = AssumedCamera()

    def of(self, sensors: Sensors) -> Sensors:
        """Return the sensors as perception takes them to be: `sensors`, with what is given here in its place.

        Where x and y come from radio ranges the camera's place is as sure as those are in line of sight.
        """
        position = {"position_std": sensors.uwb.position_std()} if sensors.uwb.anchors else {}
        return sensors.model_copy(
            update={
                "beams": sensors.beams.model_copy(update=_given(self.beams)),
                "camera": sensors.camera.model_copy(update=position | _given(self.camera)),
            }
        )


def _given(section: Section) -> dict[str, Any]:
    return {key: value for key, value in section if value is not None}
