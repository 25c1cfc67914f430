"""Shapes of `draw` as entries of `world`, in the world frame.

Each function takes the drawn values of one entry and returns the walls or boxes that it is made of, in YAML's words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.families.frame import PathFrame
from pbrg_mj.scenario.schema import WHITE

Point = tuple[float, float]
Entries = list[dict[str, Any]]
Shape = Callable[[Mapping[str, Any], PathFrame, np.random.Generator], Entries]
FEWEST_SIDES, MOST_SIDES = 3, 24
STEEPEST = 45.0  # slope of a ramp [deg]
DECIMALS = 5  # of a ramp's height [m]


def walls(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one wall across the way."""
    half = drawn["length"] / 2
    return [_across(drawn, frame, drawn["shift"] - half, drawn["shift"] + half)]


def doorways(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return the walls on both sides of an opening, in one line, and the pane in it, if there is one."""
    half, shift, length = drawn["width"] / 2, drawn["shift"], drawn["length"]
    sides = (shift - half - length, shift - half), (shift + half, shift + half + length)
    beside = [_across(drawn, frame, *side) for side in sides]
    if not drawn["pane"]:
        return beside
    pane = _across(drawn, frame, shift - half, shift + half)
    return [*beside, pane | {"thickness": drawn["pane"], "glass": True}]


def corridors(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return two parallel walls."""
    turn, off = math.radians(drawn["angle_deg"]), (drawn["width"] + drawn["thickness"]) / 2
    ends = drawn["begin"], drawn["begin"] + drawn["length"]
    sides = [[_turned(x, drawn["shift"] + y, turn) for x in ends] for y in (-off, off)]
    return [_wall(frame, first, last, drawn["thickness"]) for first, last in sides]


def rooms(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return the walls of a closed room whose corners lie on a circle."""
    return _closed(frame, _on_circle(drawn, random), drawn["thickness"])


def l_rooms(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return the walls of a closed room of two arms at a right angle."""
    turn, half = math.radians(drawn["angle_deg"]), (drawn["width"] + drawn["thickness"]) / 2
    end = half + drawn["length"]
    corners = (-half, -half), (end, -half), (end, half), (half, half), (half, end), (-half, end)
    placed = [_turned(*corner, turn) for corner in corners]
    return _closed(frame, [(drawn["along"] + x, drawn["across"] + y) for x, y in placed], drawn["thickness"])


def boxes(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one box."""
    return [
        {
            "center": frame.to_world(drawn["along"], drawn["across"]),
            "size": [drawn["length"], drawn["width"]],
            "angle_deg": frame.heading_to_world(drawn["angle_deg"]),
        }
    ]


def columns(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one column."""
    return [{"center": frame.to_world(drawn["along"], drawn["across"]), "radius": drawn["radius"]}]


def prisms(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one prism."""
    return [{"corners": [frame.to_world(*corner) for corner in _on_circle(drawn, random)]}]


def notched(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one prism like an L or a U."""
    length, width, thick, arms = (drawn[name] for name in ("length", "width", "thickness", "arms"))
    if arms not in (2, 3):
        raise InputError(f"has {arms:g} arms; allowed: 2 or 3")
    if not 0 < 2 * thick < min(length, width):
        raise InputError(f"has arms of {thick:g} m; allowed: more than 0, less than half of length and width")
    outline = [(0.0, 0.0), (length, 0.0), (length, thick if arms == 2 else width)]
    outline += [(length - thick, width), (length - thick, thick)] if arms == 3 else []
    outline += [(thick, thick), (thick, width), (0.0, width)]
    turn = math.radians(drawn["angle_deg"])
    turned = [_turned(x - length / 2, y - width / 2, turn) for x, y in outline]
    return [{"corners": [frame.to_world(drawn["along"] + x, drawn["across"] + y) for x, y in turned]}]


def thresholds(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one bar on the floor."""
    x, y = _turned(drawn["length"] / 2, 0.0, math.radians(drawn["angle_deg"]))
    start, end = ((drawn["along"] + sign * x, drawn["across"] + sign * y) for sign in (-1, 1))
    ends = {"from": frame.to_world(*start), "to": frame.to_world(*end)}
    return [{**ends, "width": drawn["width"], "height": drawn["height"]}]


def ramps(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return two wedges whose upper edges meet."""
    if not 0 < drawn["slope_deg"] < STEEPEST:
        raise InputError(f"has slopes of {drawn['slope_deg']:g} deg; allowed: more than 0, less than {STEEPEST:g}")
    height = round(drawn["length"] * math.tan(math.radians(drawn["slope_deg"])), DECIMALS)
    x, y = _turned(drawn["length"], 0.0, math.radians(drawn["angle_deg"]))
    feet = [frame.to_world(drawn["along"] + sign * x, drawn["across"] + sign * y) for sign in (-1, 1)]
    top = frame.to_world(drawn["along"], drawn["across"])
    return [{"from": foot, "to": top, "width": drawn["width"], "height": height} for foot in feet]


def moving_boxes(drawn: Mapping[str, Any], frame: PathFrame, random: np.random.Generator) -> Entries:
    """Return one moving box."""
    if drawn["speed"] <= 0:
        raise InputError(f"moves at {drawn['speed']:g} m/s; allowed: a speed greater than 0")
    step, begin = _turned(drawn["travel"], 0.0, math.radians(drawn["direction_deg"])), drawn["begin"]
    first, last = (drawn["along"], drawn["across"]), (drawn["along"] + step[0], drawn["across"] + step[1])
    end = round(begin + abs(drawn["travel"]) / drawn["speed"], 4)
    stops = [{"time": time, "center": frame.to_world(*at)} for time, at in ((begin, first), (end, last))]
    return [{"size": [drawn["length"], drawn["width"]], "waypoints": stops}]


# Entry of `draw` -> its shape, and where it goes in `world`.
SHAPES: dict[str, tuple[Shape, str]] = {
    "walls": (walls, "walls"),
    "doorways": (doorways, "walls"),
    "corridors": (corridors, "walls"),
    "rooms": (rooms, "walls"),
    "l_rooms": (l_rooms, "walls"),
    "boxes": (boxes, "boxes"),
    "columns": (columns, "columns"),
    "prisms": (prisms, "prisms"),
    "notched": (notched, "prisms"),
    "thresholds": (thresholds, "thresholds"),
    "ramps": (ramps, "ramps"),
    "moving_boxes": (moving_boxes, "moving_boxes"),
}


def _on_circle(drawn: Mapping[str, Any], random: np.random.Generator) -> list[Point]:
    """Return the corners of a convex polygon, counter-clockwise."""
    sides = int(drawn["sides"])
    if sides != drawn["sides"] or not FEWEST_SIDES <= sides <= MOST_SIDES:
        raise InputError(f"has {drawn['sides']:g} sides; allowed: {FEWEST_SIDES} to {MOST_SIDES}")
    if not 0 <= drawn["irregularity"] < 1:
        raise InputError(f"has an irregularity of {drawn['irregularity']:g}; allowed: from 0 to less than 1")
    jitter = drawn["irregularity"] * (random.random(sides) - 0.5)
    turns = math.radians(drawn["angle_deg"]) + 2 * math.pi * (np.arange(sides) + jitter) / sides
    x, y = drawn["along"] + drawn["radius"] * np.cos(turns), drawn["across"] + drawn["radius"] * np.sin(turns)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _across(drawn: Mapping[str, Any], frame: PathFrame, first: float, last: float) -> dict[str, Any]:
    """Return a wall from `first` to `last` [m] to the left of where its line crosses the way."""
    turn, off = math.radians(drawn["angle_deg"]), drawn["distance"] + drawn["thickness"] / 2
    crossing = -off * math.tan(turn)
    start, end = (_turned(off, crossing + y, turn) for y in (first, last))
    surface = {} if drawn["reflectance"] == WHITE else {"reflectance": drawn["reflectance"]}
    return _wall(frame, start, end, drawn["thickness"]) | surface


def _closed(frame: PathFrame, corners: list[Point], thickness: float) -> Entries:
    """Return walls along a closed line, each longer by half its thickness at both ends: corners have no notches."""
    ends = pairwise([*corners, corners[0]])
    longer = (_longer(start, end, thickness / 2) for start, end in ends)
    return [_wall(frame, start, end, thickness) for start, end in longer]


def _longer(start: Point, end: Point, by: float) -> tuple[Point, Point]:
    turn = math.atan2(end[1] - start[1], end[0] - start[0])
    dx, dy = by * math.cos(turn), by * math.sin(turn)
    return (start[0] - dx, start[1] - dy), (end[0] + dx, end[1] + dy)


def _wall(frame: PathFrame, start: Point, end: Point, thickness: float) -> dict[str, Any]:
    return {"from": frame.to_world(*start), "to": frame.to_world(*end), "thickness": thickness}


def _turned(x: float, y: float, turn: float) -> Point:
    return x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
