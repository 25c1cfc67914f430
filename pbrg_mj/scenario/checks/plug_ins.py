"""Parts of other packages that a scenario names: whether they are installed, and whether their options fit."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from pbrg_mj.plugin_options import option_keys, options_model, unknown_options, validated
from pbrg_mj.plugins import (
    IN_SCENARIOS,
    OBJECT,
    Kind,
    find,
    installed,
    kind_of_name,
    unknown,
    value_at,
)
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, yaml_text
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.schema.describe import describe_field


def plug_ins(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield all that is wrong with names of parts and with their options."""
    for kind in IN_SCENARIOS:
        name, options = value_at(scenario, kind.key), value_at(scenario, kind.options)
        kind = kind_of_name(kind, name)
        if name in kind.built_in:
            model = None
        elif name.startswith(OBJECT):
            continue
        elif name in (offered := installed(kind)):
            model = options_model(find(kind, name))
        else:
            yield Diagnostic(_path(kind.key), unknown(kind, name, offered))
            continue
        yield from _options(kind, name, model, options)


def _options(kind: Kind, name: str, model: type[BaseModel] | None, options: Mapping[str, Any]) -> Iterator[Diagnostic]:
    path = _path(kind.options)
    if model is None:
        if options:
            allowed = f"allowed: nothing, for the {kind.noun} {name} has no options"
            yield Diagnostic(path, f"is {yaml_text(dict(options))}; {allowed}")
        return
    fields = option_keys(model)
    for key in unknown_options(model, options):
        near = difflib.get_close_matches(key, fields, n=1)
        known = f"did you mean `{near[0]}`?" if near else f"known: {', '.join(fields)}"
        yield Diagnostic((*path, key), f"is unknown; {known}")
    try:
        validated(model, options)
    except ValidationError as error:
        for item in error.errors(include_url=False):
            if item["type"] != "extra_forbidden" or len(item["loc"]) > 1:
                yield _diagnostic(path, item, fields)


def _diagnostic(path: KeyPath, item: Mapping[str, Any], fields: Mapping[str, FieldInfo]) -> Diagnostic:
    loc = item["loc"]
    field = fields.get(str(loc[0])) if len(loc) == 1 else None
    allowed = _allowed(field) or item["msg"]
    if item["type"] == "missing":
        meaning = f" ({field.description})" if field is not None and field.description else ""
        return Diagnostic((*path, *loc), f"is missing; required: {allowed}{meaning}")
    value = "wrong" if item["type"] == "value_error" and not loc else yaml_text(item["input"])
    if item["type"] in ("value_error", "assertion_error"):
        allowed = item["msg"].partition(", ")[2]  # after pydantic's `Value error`
    return Diagnostic((*path, *loc), f"is {value}; allowed: {allowed}")


def _allowed(field: FieldInfo | None) -> str | None:
    """Return what a key allows in the words of our own schema; None for types that it has no words for."""
    try:
        return None if field is None else describe_field(field)
    except (KeyError, TypeError, ValueError):
        return None


def _path(key: str) -> KeyPath:
    return tuple(key.split("."))
