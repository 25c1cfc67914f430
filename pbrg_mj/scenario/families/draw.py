"""A family and a seed to a concrete document: a pure function."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, dotted_key, yaml_text
from pbrg_mj.scenario.families.buildings import building_around, drawn_building
from pbrg_mj.scenario.families.checks import check_draw
from pbrg_mj.scenario.families.distributions import random_of, value, values
from pbrg_mj.scenario.families.frame import PathFrame
from pbrg_mj.scenario.families.placement import placed
from pbrg_mj.scenario.families.schema import Distribution, Draw, Family, TeamDraw
from pbrg_mj.scenario.families.shapes import SHAPES
from pbrg_mj.scenario.families.team import DECIMALS, points_apart
from pbrg_mj.scenario.parse.document import Document
from pbrg_mj.scenario.parse.validation import first_error, origin, read_section
from pbrg_mj.scenario.schema.base import MOST_ROBOTS
from pbrg_mj.scenario.schema.describe import describe_at


@dataclass(frozen=True)
class DrawnValue:
    """A value that was drawn."""

    path: KeyPath  # of its key in the scenario; of a list that it is appended to
    value: Any
    drawn_by: KeyPath  # the key in the family
    appended: bool = False


def is_family(document: Document) -> bool:
    """Whether a document draws worlds."""
    return "draw" in document.data


def draw_world(document: Document, file: str) -> Document:
    """Return the concrete scenario that a family's `draw` and `seed` make; every entry keeps the line it came from.

    Raises InputError with file, line and key when `draw` is wrong or no place is found for what it draws.
    """
    draw = read_section(Family, {"draw": document.data["draw"]}, document, file).draw
    base = {name: copy.deepcopy(section) for name, section in document.data.items() if name != "draw"}
    seed = base.setdefault("seed", 1)
    wrong = check_draw(draw, base)
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed < 2**63:
        wrong.append(Diagnostic(("seed",), f"is {yaml_text(seed)}; allowed: {describe_at(('seed',))}"))
    if wrong:
        raise first_error(wrong, document, file)
    origins = {path: where for path, where in document.origins.items() if path[:1] != ("draw",)}
    for piece in _pieces(draw, seed, document, file):
        with _located(piece.drawn_by, document, file):
            path = _put(base, piece)
        origins[path] = origin(piece.drawn_by, document)
    return Document(base, origins)


def _pieces(draw: Draw, seed: int, document: Document, file: str) -> Iterator[DrawnValue]:
    with _located(("draw", "team"), document, file):
        start, formation = _places(draw.team, seed)
    yield DrawnValue(("team", "start"), start.tolist(), ("draw", "team"))
    yield DrawnValue(("team", "formation"), formation.tolist(), ("draw", "team"))
    way = values(draw.reference, random_of(seed, "reference"))
    frame = PathFrame(way["direction_deg"])
    reference = frame.to_world(way["distance"], 0.0)
    yield DrawnValue(("operator", "reference"), reference, ("draw", "reference"))
    goal = np.array(reference) + formation
    yield from _building(draw, seed, document, file, frame, way["distance"], start)
    for kind, (_, name) in SHAPES.items():
        for k in range(len(getattr(draw, kind))):
            path = ("draw", kind, k)
            with _located(path, document, file):
                entries = placed(draw, kind, k, seed, frame, start, goal)
            yield from (DrawnValue(("world", name), entry, path, appended=True) for entry in entries)
    for name, drawn in draw.keys.items():
        random = random_of(seed, f"keys.{name}")
        many = isinstance(drawn, Distribution) and drawn.per_robot
        found = [value(drawn, random) for _ in start] if many else value(drawn, random)
        yield DrawnValue(tuple(name.split(".")), _lists(found), ("draw", "keys", name))


def _building(
    draw: Draw, seed: int, document: Document, file: str, frame: PathFrame, distance: float, start: np.ndarray
) -> Iterator[DrawnValue]:
    """Yield what stands in the seed's building, if there is one, about its place there."""
    if not draw.buildings:
        return
    index = drawn_building(draw, seed)
    path = ("draw", "buildings", index)
    with _located(path, document, file):
        found = building_around(draw, index, seed, frame, distance, start)
    for name, entries in found.items():
        yield from (DrawnValue(("world", name), entry, path, appended=True) for entry in entries)


def _places(team: TeamDraw, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return hand points at the start and in the formation about its mean, both (n, 2) [m]."""
    drawn = values(team, random_of(seed, "team"))
    robots = drawn["robots"]
    if robots != int(robots) or not 1 <= robots <= MOST_ROBOTS:
        raise InputError(f"has {robots:g} robots; allowed: whole numbers from 1 to {MOST_ROBOTS}")
    start, formation = (
        points_apart(int(robots), drawn[f"{name}_radius"], team.spacing, random_of(seed, name))
        for name in ("start", "formation")
    )
    return start, np.round(formation - formation.mean(axis=0), DECIMALS)


def _put(data: dict[str, Any], piece: DrawnValue) -> KeyPath:
    """Put a value into the scenario's data; return its path there. Raises InputError where there is no section."""
    *way, last = piece.path
    place = data
    for depth, part in enumerate(way, start=1):
        inner = place.setdefault(str(part), {})
        if not isinstance(inner, dict):
            raise InputError(f"goes into {dotted_key(tuple(way[:depth]))}, which is {yaml_text(inner)}, no section")
        place = inner
    if not piece.appended:
        place[str(last)] = piece.value
        return piece.path
    listed = place.setdefault(str(last), [])
    if not isinstance(listed, list):
        raise InputError(f"goes into {dotted_key(piece.path)}, which is {yaml_text(listed)}, no list")
    listed.append(piece.value)
    return (*piece.path, len(listed) - 1)


@contextmanager
def _located(path: KeyPath, document: Document, file: str) -> Iterator[None]:
    """Say of what goes wrong inside which key of the family it belongs to."""
    try:
        yield
    except InputError as error:
        raise first_error([Diagnostic(path, error.message)], document, file) from None


def _lists(found: Any) -> Any:
    return list(map(_lists, found)) if isinstance(found, tuple | list) else found
