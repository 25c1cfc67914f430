"""The schema for editors and other programs: JSON Schema."""

from __future__ import annotations

import re
from typing import Any

from pbrg_mj.scenario.schema.scenario import Scenario

UNIT = re.compile(r"\[([^]\s]+)\]")  # in a description, as in `period of governor and control [s]`


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a scenario's YAML; a key's unit, where it has one, is `x-unit`.

    What must hold between keys is beyond it: `pbrg validate` checks that as well.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "pbrg-mj scenario"}
    return head | simplify_schema(Scenario.model_json_schema(by_alias=True))


def simplify_schema(made: dict[str, Any]) -> dict[str, Any]:
    """Return pydantic's schema without what repeats keys' names or sections' own defaults, and with `x-unit`."""
    for section in [made, *made["$defs"].values()]:
        for field in section.get("properties", {}).values():
            _tidy(field)
        section.pop("title", None)
    return made


def _tidy(field: dict[str, Any]) -> None:
    """Leave out what repeats a key's name or a section's own defaults, and name the unit."""
    field.pop("title", None)
    if isinstance(field.get("default"), dict):
        del field["default"]
    units = UNIT.findall(field.get("description", ""))
    if len(set(units)) == 1:
        field["x-unit"] = units[0]
