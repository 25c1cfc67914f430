"""What is wrong with a scenario: the path of a key, and one line that names value and allowed values."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import Any

KeyPath = tuple[str | int, ...]
LONGEST = 60  # characters of a value shown


@dataclass(frozen=True)
class Diagnostic:
    """One thing wrong: the path of the key, and a message with the value and what is allowed."""

    path: KeyPath
    message: str


def dotted_key(path: KeyPath) -> str | None:
    """Return `world.walls.0.from` for ("world", "walls", 0, "from"); None for the top level."""
    return ".".join(_key(part) for part in path) or None


def yaml_text(value: Any) -> str:
    """Return a value on one line, much as YAML has it, cut when long."""
    text = _flow(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _key(part: str | int) -> str:
    text = str(part)
    return text if text and text.isprintable() and len(text) <= LONGEST else yaml_text(text)


def _flow(value: Any) -> str:
    match value:
        case None:
            return "empty"
        case bool():
            return str(value).lower()
        case str():
            return repr(value)
        case dict():
            return "{" + ", ".join(f"{_key(key)}: {_flow(item)}" for key, item in islice(value.items(), LONGEST)) + "}"
        case list() | tuple():
            return "[" + ", ".join(_flow(item) for item in value[:LONGEST]) + "]"
    return str(value)
