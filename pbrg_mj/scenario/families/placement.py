"""Obstacles drawn again and again until the robots' starts and, of loose things, their formation are free of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import ValidationError

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.checks.distances import distances_to_column, distances_to_prism, distances_to_wall
from pbrg_mj.scenario.diagnostics import yaml_text
from pbrg_mj.scenario.families.distributions import random_of, value, values
from pbrg_mj.scenario.families.frame import PathFrame
from pbrg_mj.scenario.families.schema import Draw, Repeated
from pbrg_mj.scenario.families.shapes import SHAPES, Entries
from pbrg_mj.scenario.schema import Box, Column, Prism, Ramp, Threshold, Wall
from pbrg_mj.scenario.schema.base import MOST_OBSTACLES

MOST_DRAWS = 1000  # of one obstacle
LOOSE = ("boxes", "columns", "prisms", "notched")  # kinds that keep off the formation around the reference, too
TERRAIN: dict[str, type[Ramp | Threshold]] = {"ramps": Ramp, "thresholds": Threshold}


def placed(
    draw: Draw, kind: str, index: int, seed: int, frame: PathFrame, start: np.ndarray, goal: np.ndarray
) -> Entries:
    """Return the obstacles of one entry of `draw` as entries of `world`.

    `start` and `goal` are hand points (n, 2) [m]. Raises InputError when there are too many, or no place is found.
    """
    section: Repeated = getattr(draw, kind)[index]
    random = random_of(seed, kind, index)
    count = value(section.count, random)
    if count != int(count) or not 0 <= count <= MOST_OBSTACLES:
        raise InputError(f"has a count of {count:g}; allowed: whole numbers from 0 to {MOST_OBSTACLES}")
    keep = [(start, draw.start_clearance, "start"), (goal, draw.goal_clearance, "formation")]
    keep = keep if kind in LOOSE else keep[:1]
    found: Entries = []
    for _ in range(int(count)):
        found += _free(section, kind, random, frame, keep)
    return found


def _free(
    section: Repeated,
    kind: str,
    random: np.random.Generator,
    frame: PathFrame,
    keep: list[tuple[np.ndarray, float, str]],
) -> Entries:
    shape, _ = SHAPES[kind]
    for _ in range(MOST_DRAWS):
        entries = shape(values(section, random, leave=("count",)), frame, random)
        if all((distances(kind, entries, points) >= clearance).all() for points, clearance, _ in keep):
            return entries
    kept = " and ".join(f"{clearance:g} m from the robots' {what}" for _, clearance, what in keep)
    raise InputError(f"finds no place in {MOST_DRAWS} draws that keeps {kept}")


def distances(kind: str, entries: Entries, points: np.ndarray) -> np.ndarray:
    """Return the distance (k,) [m] of points (k, 2) from the nearest of the entries, 0 inside."""
    return np.min([_distances_to(SHAPES[kind][1], entry, points) for entry in entries], axis=0)


def _distances_to(name: str, entry: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """Return the same for one entry of `world`, where it is at the start. Raises InputError when it is none."""
    try:
        if name == "columns":
            return distances_to_column(Column.model_validate(entry), points)
        if name == "prisms":
            return distances_to_prism(Prism.model_validate(entry), points)
        if name == "moving_boxes":
            entry = {"center": entry["waypoints"][0]["center"], "size": entry["size"]}
        if name in TERRAIN:
            return distances_to_wall(TERRAIN[name].model_validate(entry).as_wall(), points)
        wall = Wall.model_validate(entry) if name == "walls" else Box.model_validate(entry).as_wall()
        return distances_to_wall(wall, points)
    except ValidationError:
        raise InputError(f"draws {yaml_text(entry)}; allowed: sizes greater than 0, places within 1e6 m") from None
