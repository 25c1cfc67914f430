"""Earlier names of keys. A document that holds them is read as if it held the names of today.

Logs embed their scenario: what was written under an earlier name must run again. Files of studies are read so, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import KeyPath, dotted_key
from pbrg_mj.scenario.parse.document import Document

Renamed = Mapping[tuple[str, ...], str]
"""Path of an earlier key, `*` for any entry of a list -> its name of today."""

RENAMED: Renamed = {
    ("disturbances", "carries"): "kidnappings",
    ("network", "silences"): "outages",
    ("network", "silent_after"): "neighbour_timeout",
    ("world", "moving_boxes", "*", "stops"): "waypoints",
}


def rename_keys(document: Document, file: str, renamed: Renamed = RENAMED) -> Document:
    """Return the document under the names of today; every entry keeps the line, or the override, it came from.

    `renamed` are a scenario's earlier names, if not given. Raises InputError with file and line when a section holds a
    key under both names.
    """
    data = _renamed(document.data, (), document, file, renamed)
    return Document(data, {renamed_path(path, renamed): origin for path, origin in document.origins.items()})


def renamed_path(path: KeyPath, renamed: Renamed = RENAMED) -> KeyPath:
    """Return a path under the names of today."""
    return tuple(_name(path[: k + 1], renamed) for k in range(len(path)))


def _name(path: KeyPath, renamed: Renamed) -> str | int:
    for old, new in renamed.items():
        if len(old) == len(path) and all(part in ("*", str(at)) for part, at in zip(old, path, strict=True)):
            return new
    return path[-1]


def _renamed(data: Any, path: KeyPath, document: Document, file: str, renamed: Renamed) -> Any:
    if isinstance(data, list):
        return [_renamed(value, (*path, k), document, file, renamed) for k, value in enumerate(data)]
    if not isinstance(data, dict):
        return data
    found: dict[str | int, Any] = {}
    for key, value in data.items():
        inner = (*path, key)
        name = _name(inner, renamed)
        if name in found or (name != key and name in data):
            line = document.origins.get(inner)
            message = f"is the earlier name of `{name}`, which is there as well; allowed: one of them"
            raise InputError(message, file=file, line=line if isinstance(line, int) else None, key=dotted_key(inner))
        found[name] = _renamed(value, inner, document, file, renamed)
    return found
