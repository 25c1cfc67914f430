"""Overrides such as `governor.rounds=20`, applied to the data before they are validated."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import KeyPath, dotted_key, yaml_text
from pbrg_mj.scenario.parse.document import DEEPEST, Document, read_document
from pbrg_mj.scenario.parse.renamed_keys import renamed_path
from pbrg_mj.scenario.parse.set_ups import SET_UP, SET_UPS, overrides_of_set_up, set_up_for


def apply_overrides(document: Document, overrides: Sequence[str]) -> Document:
    """Return the document with the overrides applied in their order.

    An entry of a list goes by its index from 0; sections that are not there yet are made. Whether a key is known is for
    the validation to say. Raises InputError naming the override for one that has no place to go.
    """
    named = [text for text in overrides if _parse(text)[0] == (SET_UP,)]
    if not named:
        return _all_applied(document, overrides)
    others = _all_applied(document, [text for text in overrides if text not in named])
    given = overrides_of_set_up(set_up_for(others.data))
    for text in overrides:
        document = _all_applied(document, given if _is_set_up(text) else (text,))
    return document


def _is_set_up(text: str) -> bool:
    """Tell whether an override is `set_up=NAME`. Raises InputError for a name that there is not."""
    path, name = _parse(text)
    if path == (SET_UP,) and name not in SET_UPS:
        raise InputError(f"override {yaml_text(text)}; allowed: {SET_UP}={' or '.join(SET_UPS)}")
    return path == (SET_UP,)


def _all_applied(document: Document, overrides: Sequence[str]) -> Document:
    for text in overrides:
        document = _apply(document, text)
    return document


def _apply(document: Document, text: str) -> Document:
    path, value = _parse(text)
    data, path = _replaced(document.data, [str(part) for part in renamed_path(path)], (), value, text)
    origins = {known: origin for known, origin in document.origins.items() if known[: len(path)] != path}
    made = {path[:length]: text for length in range(1, len(path) + 1) if path[:length] not in origins}
    return Document(data, origins | made)


@lru_cache(maxsize=256)  # each is looked at twice, and a study has the same ones in all of its runs
def _parse(text: str) -> tuple[tuple[str, ...], Any]:
    """Take `path.to.key=value` apart; the value is YAML."""
    key, equals, value = text.partition("=")
    path = tuple(part.strip() for part in key.split("."))
    if not equals or not all(path):
        raise InputError(f"override {yaml_text(text)}; allowed: path.to.key=value")
    if len(path) > DEEPEST:
        raise InputError(f"override {yaml_text(text)} has {len(path)} parts; allowed: {DEEPEST} levels")
    try:
        return path, read_document(value, "").data
    except InputError as error:
        raise InputError(f"override {yaml_text(text)}: the value {error.message}") from None


def _replaced(data: Any, path: list[str], done: KeyPath, value: Any, text: str) -> tuple[Any, KeyPath]:
    """Return the data with the value at `path`, below `done`, and the whole path with indices as numbers."""
    if not path:
        return value, done
    part, *rest = path
    if isinstance(data, dict):
        inner, whole = _replaced(data.get(part, {} if rest else None), rest, (*done, part), value, text)
        return {**data, part: inner}, whole
    if isinstance(data, list):
        k = _index(part, data, done, text)
        inner, whole = _replaced(data[k], rest, (*done, k), value, text)
        return [*data[:k], inner, *data[k + 1 :]], whole
    raise InputError(
        f"override {yaml_text(text)}: {dotted_key(done)} is {yaml_text(data)}, neither a section nor a list"
    )


def _index(part: str, data: list[Any], done: KeyPath, text: str) -> int:
    allowed = f"an index from 0 to {len(data) - 1}" if data else "nothing, the list is empty"
    if not (part.isascii() and part.isdigit() and len(part) < 10 and int(part) < len(data)):
        raise InputError(
            f"override {yaml_text(text)}: {dotted_key(done)} has no entry {yaml_text(part)}; allowed: {allowed}"
        )
    return int(part)
