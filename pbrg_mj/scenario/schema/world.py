"""`world`: walls, boxes, columns, prisms, and the floor with its thresholds and ramps."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from pbrg_mj.scenario.polygons import FLATTEST, convex_parts, flatness
from pbrg_mj.scenario.schema.base import (
    MOST_EVENTS,
    MOST_OBSTACLES,
    SMALLEST,
    NonNegative,
    Number,
    Positive,
    Probability,
    Section,
    Vector,
)

HIGHEST_THRESHOLD = 0.04  # [m] the generic robot's beams are 0.049 m up
WHITE = 0.88  # reflectance of the targets that data sheets state ranges for [-]
GLASS = Field(default=False, description="beams pass through it; robots do not")
REFLECTANCE = Field(
    default=WHITE, description="share of the light that it sends back; matters with sensors.beams.signal_range [-]"
)


class Wall(Section):
    """A straight wall: a box around the segment from -> to."""

    start: Vector = Field(alias="from", description="one end of the centre line [m]")
    end: Vector = Field(alias="to", description="the other end of the centre line [m]")
    thickness: Positive = Field(default=0.1, description="across the centre line [m]")
    height: Positive = Field(default=0.2, description="above the floor [m]")
    glass: bool = GLASS
    reflectance: Probability = REFLECTANCE


class Box(Section):
    """A box that stands still: a convex obstacle."""

    center: Vector = Field(description="middle of its footprint [m]")
    size: tuple[Positive, Positive] = Field(description="length and width of its footprint [m]")
    angle_deg: Number = Field(default=0.0, description="of its length [deg], counter-clockwise from +x")
    height: Positive = Field(default=0.2, description="above the floor [m]")
    glass: bool = GLASS
    reflectance: Probability = REFLECTANCE

    def as_wall(self) -> Wall:
        """Return the wall that covers the same area."""
        (x, y), (length, width), turn = self.center, self.size, math.radians(self.angle_deg)
        dx, dy = length / 2 * math.cos(turn), length / 2 * math.sin(turn)
        start, end = (x - dx, y - dy), (x + dx, y + dy)
        same = {"height": self.height, "glass": self.glass, "reflectance": self.reflectance}
        # Not validated: a box at the rim of what is allowed has ends beyond it.
        return Wall.model_construct(start=start, end=end, thickness=width, **same)


class Column(Section):
    """An upright round column that stands still."""

    center: Vector = Field(description="its axis [m]")
    radius: Positive = Field(description="of the column [m]")
    height: Positive = Field(default=0.2, description="above the floor [m]")
    glass: bool = GLASS
    reflectance: Probability = REFLECTANCE


class Prism(Section):
    """An upright prism that stands still. One with notches stands as convex parts, side by side."""

    corners: tuple[Vector, ...] = Field(
        description="corners of its footprint, in either order around it; sides may meet at corners alone [m]",
        min_length=3,
        max_length=64,
    )
    height: Positive = Field(default=0.2, description="above the floor [m]")
    glass: bool = GLASS
    reflectance: Probability = REFLECTANCE

    def convex(self) -> tuple[Prism, ...]:
        """Return convex prisms of the same area; itself if it is convex. Raises ValueError as `convex_parts`.

        Between corners that are on one line but for rounding there are parts thinner than a millionth of what they are
        long or high: beside others these are left out.
        """
        parts = convex_parts(self.corners)
        if len(parts) == 1:
            return (self,)
        solid = [part for part in parts if flatness(part, self.height) >= FLATTEST]
        return tuple(self.model_copy(update={"corners": part}) for part in solid or parts)


class BoxWaypoint(Section):
    """Where a moving box is at a time."""

    time: NonNegative = Field(description="when [s]")
    center: Vector = Field(description="middle of its footprint [m]")


class MovingBox(Section):
    """A box along the axes that is driven on straight lines between waypoints, whatever stands in its way.

    Beams see it, and robots collide with it. Margins and contacts count it separately from walls.
    """

    size: tuple[Positive, Positive] = Field(description="along x and along y [m]")
    waypoints: tuple[BoxWaypoint, ...] = Field(
        description="where it is when; it rests before the first and after the last",
        min_length=1,
        max_length=MOST_EVENTS,
    )
    height: Positive = Field(default=0.2, description="above the floor [m]")

    def at(self, waypoint: BoxWaypoint) -> Box:
        """Return the box as it stands at a waypoint."""
        return Box(center=waypoint.center, size=self.size, height=self.height)


class Patch(Section):
    """A rectangular working area, along the axes, with a floor of its own; a later patch lies on earlier ones."""

    start: Vector = Field(alias="from", description="one corner [m]")
    end: Vector = Field(alias="to", description="the opposite corner [m]")
    friction: Positive = Field(default=1.0, description="sliding friction against the wheels [-]")
    rolling_resistance: NonNegative = Field(
        default=0.0, description="force that resists a rolling wheel, per force that presses it down [-]"
    )


class Threshold(Section):
    """A low bar on the floor, or a platform: wheels climb it or are stopped. Margins and contacts do not count it."""

    start: Vector = Field(alias="from", description="one end of the centre line [m]")
    end: Vector = Field(alias="to", description="the other end of the centre line [m]")
    width: Positive = Field(default=0.03, description="across the centre line [m]")
    height: Annotated[float, Field(ge=SMALLEST, le=HIGHEST_THRESHOLD)] = Field(description="above the floor [m]")

    def as_wall(self) -> Wall:
        """Return the wall that covers the same area."""
        return Wall.model_construct(start=self.start, end=self.end, thickness=self.width, height=self.height)


class Ramp(Section):
    """A wedge that rises from the floor along its centre line to a face. Margins and contacts do not count it."""

    start: Vector = Field(alias="from", description="middle of its foot [m]")
    end: Vector = Field(alias="to", description="middle of its upper edge [m]")
    width: Positive = Field(description="across the centre line [m]")
    height: Positive = Field(description="of its upper edge above the floor [m]")

    def as_wall(self) -> Wall:
        """Return the wall that covers the same area."""
        return Wall.model_construct(start=self.start, end=self.end, thickness=self.width, height=self.height)


class World(Section):
    """Obstacles and floor."""

    walls: tuple[Wall, ...] = Field(default=(), description="straight walls", max_length=MOST_OBSTACLES)
    boxes: tuple[Box, ...] = Field(default=(), description="boxes that stand still", max_length=MOST_OBSTACLES)
    columns: tuple[Column, ...] = Field(default=(), description="round columns", max_length=MOST_OBSTACLES)
    prisms: tuple[Prism, ...] = Field(
        default=(), description="prisms, convex or with notches", max_length=MOST_OBSTACLES
    )
    moving_boxes: tuple[MovingBox, ...] = Field(default=(), description="boxes that move", max_length=MOST_OBSTACLES)
    floor_friction: Positive = Field(default=1.0, description="sliding friction of the floor against the wheels [-]")
    rolling_resistance: NonNegative = Field(
        default=0.0, description="force that resists a rolling wheel, per force that presses it down [-]"
    )
    patches: tuple[Patch, ...] = Field(
        default=(), description="working areas with another floor", max_length=MOST_OBSTACLES
    )
    thresholds: tuple[Threshold, ...] = Field(
        default=(), description="low bars on the floor that wheels climb", max_length=MOST_OBSTACLES
    )
    ramps: tuple[Ramp, ...] = Field(default=(), description="wedges that robots drive on", max_length=MOST_OBSTACLES)

    @property
    def all_obstacles(self) -> tuple[Wall | Box | Column | Prism | MovingBox, ...]:
        """All obstacles, moving ones too."""
        return (*self.walls, *self.boxes, *self.columns, *self.prisms, *self.moving_boxes)

    @property
    def terrain(self) -> tuple[Threshold | Ramp, ...]:
        """What stands out of the floor and is driven on."""
        return (*self.thresholds, *self.ramps)

    @property
    def obstacles(self) -> tuple[Wall, ...]:
        """All that stands still and is rectangular: the walls, then the boxes as walls."""
        return (*self.walls, *(box.as_wall() for box in self.boxes))
