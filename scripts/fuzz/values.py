"""Numbers, texts and lists that nobody expects; and values that a schema allows."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

Rng = np.random.Generator

NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 2, -0.0, 0.0, 0.5, 1e-9, 1e-3, 1e3, 1e6, 1e9, 1e12, 1e20, 1e100, 1e150, 1e154, 1e200, 1e300, 1e308),
    *(5e-324, 1e-308, 1e-300, 1e-160, -1e308, -5e-324, -1e-9, -1e6, math.inf, -math.inf, math.nan),
    *(2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63 - 1, 2**63, 2**64, 10**30, -(2**63), -(10**30), 10**60),
)
TEXTS = (
    *("", " ", "0", "1e3", "nan", "true", "null", "~", "all", "ring", "\x00", "\n", "\t", "é", "\u202e", "\U0001f916"),
    *("\ufeff", "\x1b[31m", "a" * 1000, "../../etc/passwd", "%s%n", "{0}", "$(id)", "*a", "&a", "!!python/object:os.x"),
)


def hostile(rng: Rng) -> Any:
    """Return plain data of any kind."""
    match rng.integers(8):
        case 0 | 1 | 2 | 3:
            return pick(rng, NUMBERS)
        case 4:
            return pick(rng, TEXTS)
        case 5:
            return pick(rng, (None, True, False, [], {}, [[]], [{}], {"": 0}, {"a": {"b": {}}}))
        case 6:
            return [pick(rng, NUMBERS) for _ in range(int(rng.integers(1, 5)))]
        case _:
            return [hostile_item(rng)] * int(10 ** rng.uniform(0, 4))


def hostile_item(rng: Rng) -> Any:
    """Return a number, or a few in a list."""
    return [pick(rng, NUMBERS) for _ in range(int(rng.integers(1, 4)))] if rng.random() < 0.5 else pick(rng, NUMBERS)


def nearby(rng: Rng, number: float) -> float | int:
    """Return another number: of another size, sign, or a little off."""
    match rng.integers(4):
        case 0:
            value = number * 10 ** rng.uniform(-2, 2)
        case 1:
            value = number + rng.normal()
        case 2:
            value = -number
        case _:
            value = number * (1 + 1e-3 * rng.normal())
    return round(value) if isinstance(number, int) and math.isfinite(value) else float(value)


def allowed(rng: Rng, schema: dict[str, Any], definitions: dict[str, Any]) -> Any:
    """Return a value that the part of a JSON Schema allows, nearly always."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rsplit("/", 1)[-1]]
    if "anyOf" in schema:
        return allowed(rng, pick(rng, schema["anyOf"]), definitions)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return pick(rng, schema["enum"])
    match schema.get("type"):
        case "boolean":
            return bool(rng.integers(2))
        case "integer":
            return int(_number(rng, schema))
        case "number":
            return _number(rng, schema)
        case "array":
            return _list(rng, schema, definitions)
        case "object":
            fields = schema.get("properties", {})
            wanted = [name for name in fields if name in schema.get("required", ()) or rng.random() < 0.3]
            return {name: allowed(rng, fields[name], definitions) for name in wanted}
        case "string":
            return pick(rng, TEXTS)
    return None


def _number(rng: Rng, schema: dict[str, Any]) -> float:
    """Return a number within bounds, of any size between a thousandth and a thousand where there are none."""
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if low is not None and high is not None:
        return float(rng.uniform(low, high)) if rng.random() < 0.8 else pick(rng, (low, high))
    size = float(10 ** rng.uniform(-3, 3))
    return low + size if low is not None else high - size if high is not None else pick(rng, (-1, 1)) * size


def _list(rng: Rng, schema: dict[str, Any], definitions: dict[str, Any]) -> list[Any]:
    if "prefixItems" in schema:
        return [allowed(rng, item, definitions) for item in schema["prefixItems"]]
    least = schema.get("minItems", 0)
    count = int(rng.integers(least, least + 4))
    return [allowed(rng, schema.get("items", {}), definitions) for _ in range(count)]


def yaml(value: Any) -> str:
    """Return plain data as YAML in one line."""
    match value:
        case dict():
            return "{" + ", ".join(f"{json.dumps(key)}: {yaml(inner)}" for key, inner in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(yaml, value)) + "]"
        case float() if not math.isfinite(value):
            return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
        case float():
            return repr(value).replace("e", ".0e") if "." not in repr(value) else repr(value)
        case str() | bool() | None:
            return json.dumps(value, ensure_ascii=False)
    return str(value)


def pick(rng: Rng, some: Any) -> Any:
    """Return one of some."""
    return some[int(rng.integers(len(some)))]
