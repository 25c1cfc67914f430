"""`draw`: what a family of worlds draws anew for each seed.

Places are in the frame of the team's way: `along` from the team's centre at the start towards the reference, `across`
to the left of that.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from pbrg_mj.scenario.schema import WHITE
from pbrg_mj.scenario.schema.base import MOST_OBSTACLES, NonNegative, Number, Positive, Section, Vector

MOST_CHOICES = 1000
MOST_ENTRIES = 100  # of each kind
LEAST_SPACING = (
    0.2  # [m] bodies of 0.12 m about points 0.04 m behind hand points never overlap, whatever their headings
)
LEAST_CLEARANCE = 0.1  # [m] of a hand point: the body is within


class Distribution(Section):
    """How a value is drawn: exactly one of `uniform`, `log_uniform`, `normal`, `integer`, `choice`."""

    uniform: tuple[Number, Number] | None = Field(default=None, description="lowest and highest value")
    log_uniform: tuple[Number, Number] | None = Field(
        default=None, description="lowest and highest value, > 0; the logarithm is uniform"
    )
    normal: tuple[Number, Number] | None = Field(
        default=None, description="mean and standard deviation; cut off at three deviations"
    )
    integer: tuple[int, int] | None = Field(default=None, description="lowest and highest whole number")
    choice: tuple[Any, ...] | None = Field(
        default=None, description="values of any kind, equally likely", min_length=1, max_length=MOST_CHOICES
    )
    per_robot: bool = Field(default=False, description="in `keys` alone: a list, drawn anew for each robot")


Drawn = Number | Distribution


class TeamDraw(Section):
    """Robots, their starts and their formation: points in a disc, each at its own random place."""

    robots: Drawn = Field(description="number of robots [-]")
    start_radius: Drawn = Field(description="of the disc of the hand points at the start, around the origin [m]")
    formation_radius: Drawn = Field(description="of the disc of the formation, around the reference [m]")
    spacing: Annotated[float, Field(ge=LEAST_SPACING, le=100)] = Field(
        default=0.3, description="least distance of hand points from each other, in both [m]"
    )


class ReferenceDraw(Section):
    """The operator's constant reference."""

    distance: Drawn = Field(description="from the team's centre at the start, the origin [m]")
    direction_deg: Drawn = Field(default=0.0, description="of the way there, counter-clockwise from +x [deg]")


class Repeated(Section):
    """Obstacles of one kind."""

    count: Drawn = Field(default=1.0, description="how many, each drawn for itself [-]")


class WallDraw(Repeated):
    """Walls across the way."""

    distance: Drawn = Field(description="of its face from the team's centre at the start [m]")
    angle_deg: Drawn = Field(default=0.0, description="0: square to the way [deg]")
    shift: Drawn = Field(default=0.0, description="of its middle from the way, to the left [m]")
    length: Drawn = Field(default=8.0, description="of the wall [m]")
    thickness: Drawn = Field(default=0.1, description="of the wall [m]")
    reflectance: Drawn = Field(
        default=WHITE, description="share of light that comes back; felt by sensors that lose weak echoes [-]"
    )


class DoorwayDraw(WallDraw):
    """Walls across the way with an opening."""

    width: Drawn = Field(description="of the opening [m]")
    length: Drawn = Field(default=3.0, description="of the wall on either side [m]")
    pane: Drawn = Field(default=0.0, description="thickness of a pane of glass in the opening; 0: none [m]")


class CorridorDraw(Repeated):
    """Two parallel walls along the way."""

    width: Drawn = Field(description="between their faces [m]")
    begin: Drawn = Field(default=-1.0, description="where they begin along the way; below 0: behind the team [m]")
    length: Drawn = Field(description="of both [m]")
    angle_deg: Drawn = Field(default=0.0, description="0: along the way [deg]")
    shift: Drawn = Field(default=0.0, description="of their middle from the way, to the left [m]")
    thickness: Drawn = Field(default=0.1, description="of both walls [m]")


class RoomDraw(Repeated):
    """Closed rooms whose corners lie on a circle: convex."""

    along: Drawn = Field(default=0.0, description="of the circle's centre [m]")
    across: Drawn = Field(default=0.0, description="of the circle's centre [m]")
    radius: Drawn = Field(description="of the circle [m]")
    sides: Drawn = Field(default=4.0, description="number of walls, 3 to 24 [-]")
    irregularity: Drawn = Field(
        default=0.0, description="largest turn of a corner on the circle per angle between corners, below 1 [-]"
    )
    angle_deg: Drawn = Field(default=0.0, description="of the first corner [deg]")
    thickness: Drawn = Field(default=0.1, description="of the walls [m]")


class LRoomDraw(Repeated):
    """Closed rooms of two arms at a right angle: not convex."""

    along: Drawn = Field(default=0.0, description="of the elbow's middle [m]")
    across: Drawn = Field(default=0.0, description="of the elbow's middle [m]")
    width: Drawn = Field(description="of both arms, between faces [m]")
    length: Drawn = Field(description="of both arms beyond the elbow [m]")
    angle_deg: Drawn = Field(default=0.0, description="of the right arm [deg]; the left one is 90 deg on")
    thickness: Drawn = Field(default=0.1, description="of the walls [m]")


class Scattered(Repeated):
    """Things beside, on or behind the way."""

    along: Drawn = Field(description="of its middle [m]")
    across: Drawn = Field(default=0.0, description="of its middle [m]")
    angle_deg: Drawn = Field(default=0.0, description="of its length from the way [deg]")


class BoxDraw(Scattered):
    """Boxes and, where `width` is small, boards."""

    length: Drawn = Field(description="of the footprint [m]")
    width: Drawn = Field(description="of the footprint [m]")


class ColumnDraw(Repeated):
    """Round columns."""

    along: Drawn = Field(description="of its axis [m]")
    across: Drawn = Field(default=0.0, description="of its axis [m]")
    radius: Drawn = Field(description="of the column [m]")


class PrismDraw(Scattered):
    """Upright prisms whose corners lie on a circle: convex."""

    radius: Drawn = Field(description="of the circle [m]")
    sides: Drawn = Field(default=6.0, description="number of faces, 3 to 24 [-]")
    irregularity: Drawn = Field(
        default=0.0, description="largest turn of a corner on the circle per angle between corners, below 1 [-]"
    )


class NotchedDraw(Scattered):
    """Upright prisms like an L or a U: not convex."""

    length: Drawn = Field(description="of the longer side [m]")
    width: Drawn = Field(description="of the side across it [m]")
    thickness: Drawn = Field(description="of the arms, below half of length and width [m]")
    arms: Drawn = Field(default=2.0, description="2: an L; 3: a U, open to one long side [-]")


class ThresholdDraw(Scattered):
    """Low bars on the floor, which wheels climb or which stop them."""

    length: Drawn = Field(description="of the bar [m]")
    width: Drawn = Field(default=0.03, description="of the bar [m]")
    height: Drawn = Field(description="above the floor [m]")


class RampDraw(Scattered):
    """Two wedges back to back: a way up along `angle_deg`, and down again."""

    length: Drawn = Field(description="of each of the two slopes, on the floor [m]")
    width: Drawn = Field(description="across the slopes [m]")
    slope_deg: Drawn = Field(description="of both [deg]")


class MovingBoxDraw(Repeated):
    """Boxes along the world's axes that move once, straight on, whatever stands in their way."""

    along: Drawn = Field(description="of its middle before it moves [m]")
    across: Drawn = Field(default=0.0, description="of its middle before it moves [m]")
    length: Drawn = Field(description="of the footprint along x [m]")
    width: Drawn = Field(description="of the footprint along y [m]")
    direction_deg: Drawn = Field(description="of its motion, from the way [deg]")
    speed: Drawn = Field(description="of its motion [m/s]")
    travel: Drawn = Field(description="length of its motion [m]")
    begin: Drawn = Field(default=0.0, description="of its motion [s]")


class BuildingDraw(Section):
    """A building and a way through it; the team's centre starts on the way, which leads to the reference."""

    walls: tuple[Annotated[tuple[Vector, ...], Field(min_length=2)], ...] = Field(
        description="corners of outlines, in the building's frame [m]"
    )
    posts: tuple[Vector, ...] = Field(default=(), description="middles of single round posts [m]")
    way: tuple[Vector, ...] = Field(
        min_length=2,
        description="corners of the way; the reference is where it first is draw.reference.distance off the start [m]",
    )
    within: Positive = Field(
        default=7.0, description="of the team's centre at the start: what is farther is left out [m]"
    )
    thickness: Positive = Field(default=0.04, description="of walls and posts [m]")


def _entries(what: str) -> Any:
    return Field(default=(), description=what, max_length=MOST_ENTRIES)


class Draw(Section):
    """What is drawn anew for each seed."""

    team: TeamDraw
    reference: ReferenceDraw
    start_clearance: Annotated[float, Field(ge=LEAST_CLEARANCE, le=100)] = Field(
        default=0.3, description="least distance of all obstacles from hand points at the start [m]"
    )
    goal_clearance: NonNegative = Field(
        default=0.2,
        description="least distance of boxes, columns and prisms from hand points in formation at the reference [m]",
    )
    walls: tuple[WallDraw, ...] = _entries("walls across the way")
    doorways: tuple[DoorwayDraw, ...] = _entries("walls with an opening")
    corridors: tuple[CorridorDraw, ...] = _entries("pairs of parallel walls")
    rooms: tuple[RoomDraw, ...] = _entries("convex rooms")
    l_rooms: tuple[LRoomDraw, ...] = _entries("L-shaped rooms")
    boxes: tuple[BoxDraw, ...] = _entries("boxes and boards")
    columns: tuple[ColumnDraw, ...] = _entries("round columns")
    prisms: tuple[PrismDraw, ...] = _entries("convex prisms")
    notched: tuple[NotchedDraw, ...] = _entries("prisms like an L or a U")
    thresholds: tuple[ThresholdDraw, ...] = _entries("low bars on the floor")
    ramps: tuple[RampDraw, ...] = _entries("ways up and down")
    moving_boxes: tuple[MovingBoxDraw, ...] = _entries("boxes that move")
    buildings: tuple[BuildingDraw, ...] = _entries("buildings, one of which is drawn")
    keys: dict[str, Drawn] = Field(
        default={}, description="any other key of the scenario by its dotted name, such as `sensors.beams.preset`"
    )


class Family(Section):
    """A scenario with this section is a family of worlds; what the section draws may be missing from the others."""

    draw: Draw = Field(description=f"of at most {MOST_OBSTACLES} obstacles of each kind of `world`")
