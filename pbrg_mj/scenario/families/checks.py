"""What must hold between the keys of `draw`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, yaml_text
from pbrg_mj.scenario.families.schema import Distribution, Draw
from pbrg_mj.scenario.schema import Section

KINDS = tuple(name for name in Distribution.model_fields if name != "per_robot")
RANGES = ("uniform", "log_uniform", "integer")
NOT_DRAWN = ("seed", "draw")


def check_draw(draw: Draw, base: dict[str, Any]) -> list[Diagnostic]:
    """Return all that is wrong between keys that are right one by one; `base` are the family's other sections."""
    return [*_distributions(draw, ("draw",)), *_names(draw), *_overridden_by_draw(base)]


def check_distributions(entry: Any) -> Iterator[Diagnostic]:
    """Yield what is wrong with the distributions within a section, of another file than a family's as well."""
    yield from _distributions(entry, ())


def _distributions(entry: Any, path: KeyPath) -> Iterator[Diagnostic]:
    """Yield what is wrong with the distributions within an entry."""
    if isinstance(entry, Distribution):
        yield from _distribution(entry, path)
    elif isinstance(entry, Section):
        for name in type(entry).model_fields:
            yield from _distributions(getattr(entry, name), (*path, name))
    elif isinstance(entry, tuple):
        for k, one in enumerate(entry):
            yield from _distributions(one, (*path, k))
    elif isinstance(entry, dict):
        for name, one in entry.items():
            yield from _distributions(one, (*path, name))


def _distribution(entry: Distribution, path: KeyPath) -> Iterator[Diagnostic]:
    given = [name for name in KINDS if getattr(entry, name) is not None]
    if len(given) != 1:
        yield Diagnostic(path, f"has {' and '.join(given) or 'no distribution'}; allowed: one of {', '.join(KINDS)}")
        return
    kind, numbers = given[0], getattr(entry, given[0])
    if kind in RANGES and numbers[0] > numbers[1]:
        yield Diagnostic((*path, kind), f"is {yaml_text(numbers)}; allowed: the lowest value first")
    if kind == "log_uniform" and min(numbers) <= 0:
        yield Diagnostic((*path, kind), f"is {yaml_text(numbers)}; allowed: numbers greater than 0")
    if kind == "normal" and numbers[1] < 0:
        yield Diagnostic((*path, kind), f"is {yaml_text(numbers)}; allowed: a deviation of 0 or more")
    if entry.per_robot and path[:2] != ("draw", "keys"):
        yield Diagnostic((*path, "per_robot"), "is true; allowed: under draw.keys alone")


def _names(draw: Draw) -> Iterator[Diagnostic]:
    for name in draw.keys:
        if name.split(".")[0] in NOT_DRAWN:
            yield Diagnostic(("draw", "keys", name), f"is not drawn; allowed: any key but {', '.join(NOT_DRAWN)}")


def _overridden_by_draw(base: dict[str, Any]) -> Iterator[Diagnostic]:
    """Yield what stands in the family although `draw.team` and `draw.reference` make it."""
    drawn = {"team": (("start", "team"), ("formation", "team")), "operator": (("reference", "reference"),)}
    for section, names in drawn.items():
        there = base.get(section)
        for name, by in names if isinstance(there, dict) else ():
            if name in there:
                yield Diagnostic((section, name), f"is drawn by draw.{by}; allowed: one of them")
