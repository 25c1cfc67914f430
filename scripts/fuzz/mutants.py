"""Bundled scenarios with accidents: keys removed, added, retyped, extreme; damaged text; hostile overrides."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from pbrg_mj.plugins import IN_SCENARIOS
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.parse.document import read_document
from pbrg_mj.scenario.schema.json_schema import json_schema
from scripts.fuzz.damage import TOKENS, damaged_text
from scripts.fuzz.values import Rng, allowed, hostile, nearby, pick, yaml

SMALL, LARGE_SHARE = 12, 0.02  # robots, and how many scenarios are of larger teams: a tick of fifty takes long
PARTS = {tuple(kind.key.split(".")): kind.built_in for kind in IN_SCENARIOS}  # names that the schema does not list
RECOMMENDED = "set_up=recommended"
Path = tuple[str | int, ...]
Known = Callable[[Rng], tuple[Path, Any]]
"""Chooses the path of a key that a file may have, and a value that its schema allows."""


@dataclass(frozen=True)
class Mutant:
    """A scenario as a command gets it: the text of a file, and overrides."""

    origin: str
    content: bytes
    overrides: tuple[str, ...] = ()


def mutant(seed: int) -> Mutant:
    """Return the mutant of that number."""
    rng = np.random.default_rng((12, seed))
    name = pick(rng, _names(large=rng.random() < LARGE_SHARE))
    original = bundled_scenarios()[name].read_bytes()
    kind = rng.random()
    if kind < 0.4:
        return Mutant(name, changed_data(rng, original.decode()))
    if kind < 0.65:
        return Mutant(name, original, overrides(rng, original.decode()))
    if kind < 0.66:
        return Mutant(f"{name}, another team", _other_team(rng, original.decode()))
    for _ in range(rng.integers(1, 4)):
        original = damaged_text(rng, original)
    return Mutant(name, original)


@cache
def _names(large: bool) -> tuple[str, ...]:
    sizes = {name: len(read(path.read_text())["team"]["start"]) for name, path in bundled_scenarios().items()}
    return tuple(name for name, size in sizes.items() if (size > SMALL) == large)


def read(text: str) -> Any:
    """Return a scenario's plain data."""
    return copy.deepcopy(_read_once(text))


@cache
def _read_once(text: str) -> Any:
    return read_document(text, "").data


def changed_data(rng: Rng, text: str, known: Known | None = None) -> bytes:
    """Return the YAML with one to three accidents to its keys and values; scenarios' own keys are known."""
    data = read(text)
    for _ in range(rng.integers(1, 4)):
        data = _change(rng, data, known or known_of_scenarios)
    return _text(data)


def _text(data: Any) -> bytes:
    """Return data as YAML, a line for each section."""
    lines = [f"{key}: {yaml(value)}\n" for key, value in data.items()] if isinstance(data, dict) else [yaml(data)]
    return "".join(lines).encode("utf-8", "replace")


def _change(rng: Rng, data: Any, known: Known) -> Any:
    """Return the data with one accident."""
    paths = list(_paths(data))
    if not paths:
        return data
    path = pick(rng, paths)
    kind = rng.integers(10)
    if kind < 3:  # a known key, with a value that is allowed
        return _put(data, *known(rng))
    value = _get(data, path)
    if kind < 6 and isinstance(value, int | float):
        return _put(data, path, nearby(rng, value))
    if kind == 6:
        return _put(data, pick(rng, (path, known(rng)[0])), hostile(rng))
    if kind == 7:
        return _put(data, path, None, remove=True)
    if kind == 8:
        other = pick(rng, (copy.deepcopy(_get(data, pick(rng, paths))), [value], {"a": value}, str(value)))
        return _put(data, path, other)
    if isinstance(value, list) and value:
        longer = value * int(10 ** rng.uniform(0, 3))
        return _put(data, path, pick(rng, (longer, value[:-1], value[::-1], [*value, value[0]], [])))
    return _put(data, (*path[:-1], f"{path[-1]}{pick(rng, ('s', '_', ' ', 'é'))}"), value)


def _paths(data: Any, at: Path = ()) -> Iterator[Path]:
    """Yield the paths of all entries."""
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in entries:
        yield (*at, key)
        yield from _paths(value, (*at, key))


def _get(data: Any, path: Path) -> Any:
    for key in path:
        data = data[key]
    return data


def _put(data: Any, path: Path, value: Any, remove: bool = False) -> Any:
    """Change an entry, and make the sections on the way; where the path leads through something else, change that."""
    at = data
    for key in path[:-1]:
        if isinstance(at, dict) and not isinstance(at.get(key), dict | list):
            at[key] = {}
        if not _holds(at, key):
            return data
        at = at[key]
    key = path[-1]
    if remove and _holds(at, key):
        del at[key]
    elif isinstance(at, dict) or _holds(at, key):
        at[key] = value
    return data


def _holds(data: Any, key: str | int) -> bool:
    return key in data if isinstance(data, dict) else isinstance(key, int) and key < len(data)


def known_of_scenarios(rng: Rng) -> tuple[Path, Any]:
    """Return the path of a key that scenarios may have, and a value that its schema allows."""
    if rng.random() < 0.1:
        path = pick(rng, list(PARTS))
        return path, pick(rng, PARTS[path])
    return _of_scenarios()(rng)


@cache
def _of_scenarios() -> Known:
    return known_keys(json_schema())


def known_keys(schema: dict[str, Any]) -> Known:
    """Return what chooses among all keys of a JSON Schema that are no sections."""
    definitions = schema.get("$defs", {})
    keys = tuple(_keys(schema, definitions, ()))

    def choose(rng: Rng) -> tuple[Path, Any]:
        path, field = pick(rng, keys)
        return path, allowed(rng, field, definitions)

    return choose


def _keys(schema: dict[str, Any], definitions: dict[str, Any], at: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    for key, field in schema.get("properties", {}).items():
        section = definitions.get(field.get("$ref", "").rsplit("/", 1)[-1])
        yield from _keys(section, definitions, (*at, key)) if section else (((*at, key), field),)


def overrides(rng: Rng, text: str) -> tuple[str, ...]:
    """Return one to three overrides of a scenario or a family; now and then the recommended set-up before them."""
    found = tuple(_override(rng, text) for _ in range(rng.integers(1, 4)))
    return (RECOMMENDED, *found) if rng.random() < 0.15 else found


def _override(rng: Rng, text: str) -> str:
    """Return `path.to.key=value`, mostly."""
    known, value = known_of_scenarios(rng)
    path = pick(rng, (known, known, pick(rng, list(_paths(read(text))))))
    value = pick(rng, (value, value, hostile(rng)))
    dotted = ".".join(map(str, path))
    written = yaml(value)
    match rng.integers(12):
        case 0:
            return pick(rng, (dotted, f"={written}", f"{dotted}.={written}", f".{dotted}={written}", "", "=", "..=1"))
        case 1:
            return ".".join(["a"] * int(10 ** rng.uniform(0, 3.5))) + "=1"
        case 2:
            return f"{dotted}={pick(rng, TOKENS)}{written}"
        case 3:
            return f"{dotted}={'[' * int(10 ** rng.uniform(0, 3))}"
    return f"{dotted}={written}"


def _other_team(rng: Rng, text: str) -> bytes:
    """Return the scenario with a team of another size and graph, at one place by alias or on a grid."""
    n = int(10 ** rng.uniform(0, 3.7 if rng.random() < 0.3 else 1.5))
    side, spacing = int(np.ceil(np.sqrt(n))), float(pick(rng, (0.0, 0.1, 0.25, 0.5, 1e3)))
    data = read(text)
    data["team"] = {"start": None, "formation": None, "leaders": [int(rng.integers(1, n + 1))]}
    data["graph"] = {"kind": pick(rng, ("ring", "path", "complete"))}
    places = [f"[{spacing * (k % side):g}, {spacing * (k // side):g}]" for k in range(n)]
    if rng.random() < 0.3:
        places = ["&a [0.0, 0.0]"] + ["*a"] * (n - 1)
    head = {key: value for key, value in data.items() if key not in ("team", "description")}
    if rng.random() < 0.5:
        head.pop("sensors", None)
    team = f"team:\n  leaders: {data['team']['leaders']}\n  start: [{', '.join(places)}]\n"
    return (
        _text(head) + (team + f"  formation: [{', '.join(places).replace('&a', '&b').replace('*a', '*b')}]\n").encode()
    )
