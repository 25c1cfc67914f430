"""The schema in words: what each key allows. Errors and the reference page both read it from here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic.fields import FieldInfo

from pbrg_mj.scenario.diagnostics import KeyPath
from pbrg_mj.scenario.schema import Scenario, Section


def keys(section: type[Section]) -> dict[str, FieldInfo]:
    """Return a section's fields by the names they have in YAML."""
    return {field.alias or name: field for name, field in section.model_fields.items()}


def describe_field(field: FieldInfo) -> str:
    """Return what a key allows, such as `a number greater than 0`."""
    return describe(field.annotation, field.metadata)


def describe_at(path: KeyPath, root: type[Section] = Scenario) -> str:
    """Return what is allowed at a path into a scenario, or another section; the path must exist in the schema."""
    kind, metadata = root, ()
    for part in path:
        kind, metadata = _inside(kind, part)
    return describe(kind, metadata)


def section_at(path: KeyPath, root: type[Section] = Scenario) -> type[Section]:
    """Return the section that the schema has at a path into a scenario, or another section."""
    kind: Any = root
    for part in path:
        kind, _ = _inside(kind, part)
    return _member(kind, lambda one: isinstance(one, type) and issubclass(one, Section))


def describe(kind: Any, metadata: Sequence[Any] = (), many: bool = False) -> str:
    """Return a type of the schema in words, in the singular or for many."""
    kind, metadata = _bare(kind, metadata)
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(describe(member, metadata, many) for member in get_args(kind))
    if get_origin(kind) is Literal:
        return _choice(get_args(kind))
    if get_origin(kind) is tuple:
        return _list(kind, metadata, many)
    if isinstance(kind, type) and issubclass(kind, Section):
        return f"{'sections' if many else 'a section'} with the keys {', '.join(keys(kind))}"
    if get_origin(kind) is dict:
        return "keys and values"
    if kind is Any:
        return "values of any kind" if many else "any value"
    one, several = {
        float: ("a number", "numbers"),
        int: ("a whole number", "whole numbers"),
        bool: ("true or false", "true or false"),
        str: ("text", "texts"),
        NoneType: ("null", "null"),
    }[kind]
    return (several if many else one) + _bounds(metadata)


def _bare(kind: Any, metadata: Sequence[Any]) -> tuple[Any, tuple[Any, ...]]:
    """Take `Annotated` apart."""
    found = list(metadata)
    while get_origin(kind) is Annotated:
        kind, *extra = get_args(kind)
        for item in extra:
            found.extend(item.metadata if isinstance(item, FieldInfo) else [item])
    return kind, tuple(found)


def _choice(values: tuple[Any, ...]) -> str:
    return str(values[0]) if len(values) == 1 else "one of " + ", ".join(map(str, values))


def _list(kind: Any, metadata: Sequence[Any], many: bool) -> str:
    first, *rest = get_args(kind)
    if rest != [...]:
        return f"{'pairs' if many else 'a pair'} of {describe(first, many=True)}"
    least = [str(item.min_length) for item in metadata if isinstance(item, MinLen)]
    most = [str(item.max_length) for item in metadata if isinstance(item, MaxLen)]
    count = f"{least[0]} to {most[0]} " if least and most else "".join([f"at most {one} " for one in most])
    count = count or "".join([f"{one} or more " for one in least])
    return f"{'lists' if many else 'a list'} of {count}{describe(first, many=True)}"


def _bounds(metadata: Sequence[Any]) -> str:
    words = {Gt: ("greater than", "gt"), Ge: ("at least", "ge"), Lt: ("less than", "lt"), Le: ("at most", "le")}
    named = [(*words[type(item)], item) for item in metadata if type(item) in words]
    if [type(item) for *_, item in named] == [Ge, Le]:
        return f" from {_short(named[0][2].ge)} to {_short(named[1][2].le)}"
    found = [f"{word} {_short(getattr(item, name))}" for word, name, item in named]
    return " " + " and ".join(found) if found else ""


def _short(number: float) -> str:
    """Return 1e9 for 1000000000.0."""
    return f"{number:g}".replace("e+0", "e").replace("e-0", "e-") if isinstance(number, float) else str(number)


def _inside(kind: Any, part: str | int) -> tuple[Any, tuple[Any, ...]]:
    """Return the type one step down a path, and its bounds."""
    kind, _ = _bare(kind, ())
    kind = _member(kind, lambda one: get_origin(one) is tuple if isinstance(part, int) else not _scalar(one))
    if get_origin(kind) is tuple:
        return _bare(get_args(kind)[0], ())
    if get_origin(kind) is dict:
        return _bare(get_args(kind)[1], ())
    field = keys(kind)[str(part)]
    return _bare(field.annotation, field.metadata)


def _member(kind: Any, wanted: Callable[[Any], bool]) -> Any:
    """Return the first wanted member of a union; anything else itself."""
    if get_origin(kind) not in (Union, UnionType):
        return kind
    return next(one for one in (_bare(member, ())[0] for member in get_args(kind)) if wanted(one))


def _scalar(kind: Any) -> bool:
    return get_origin(kind) not in (tuple, dict) and not (isinstance(kind, type) and issubclass(kind, Section))
