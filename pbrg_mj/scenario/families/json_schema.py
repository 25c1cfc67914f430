"""The schema of families for editors: that of a scenario, with `draw`."""

from __future__ import annotations

from typing import Any

from pbrg_mj.scenario.families.schema import Family
from pbrg_mj.scenario.schema.json_schema import json_schema, simplify_schema


def family_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a family's YAML: `draw` is required, what it draws is not."""
    made, drawn = json_schema(), simplify_schema(Family.model_json_schema(by_alias=True))
    made["title"] = "pbrg-mj family of worlds"
    made["properties"] |= drawn["properties"]
    made["$defs"] |= drawn["$defs"]
    made["required"] = ["draw"]
    made["$defs"]["Team"].pop("required")
    return made
