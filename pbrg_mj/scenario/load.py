"""From a file, or a bundled scenario's or family's name, to a Scenario."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import yaml_text
from pbrg_mj.scenario.families.draw import draw_world, is_family
from pbrg_mj.scenario.find import find_scenario
from pbrg_mj.scenario.parse.document import MOST_BYTES, TOO_LARGE, Document, read_document, write_document
from pbrg_mj.scenario.parse.overrides import apply_overrides
from pbrg_mj.scenario.parse.renamed_keys import rename_keys
from pbrg_mj.scenario.parse.validation import build
from pbrg_mj.scenario.schema import Scenario

DRAW_KEYS = ("draw", "seed")  # overrides of these change what is drawn; all others what was drawn


@dataclass(frozen=True)
class FamilySource:
    """What a world was drawn from."""

    text: str  # YAML, as in its file
    overrides: tuple[str, ...]
    file: str


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario, and the YAML text it can be had from again."""

    scenario: Scenario
    name: str  # the bundled name, or the file's stem
    yaml_text: str  # as run: with the overrides in it, and of a family the world that its seed draws
    family: FamilySource | None = None


def load_scenario(source: str | Path, overrides: Sequence[str] = ()) -> LoadedScenario:
    """Return the scenario in a YAML file, or the bundled one of that name, with `path.to.key=value` overrides.

    Raises InputError: one line with file, line, key, what is wrong and what is allowed.
    """
    text, name, file = scenario_text(source)
    return load_text(text, name, overrides, file=file)


def scenario_text(source: str | Path) -> tuple[str, str, str]:
    """Return the YAML text of a file or a bundled scenario, its name, and the file. Raises InputError."""
    path, name = find_scenario(source)
    return read_text(path), name, str(path)


def load_text(text: str, name: str, overrides: Sequence[str] = (), *, file: str) -> LoadedScenario:
    """Return the scenario in a YAML text, or the world that its `draw` and `seed` make, with overrides.

    `file` is for the errors. Raises InputError.
    """
    document = _document(text, file)
    if is_family(document):
        return _load_world(document, name, FamilySource(text, tuple(overrides), file))
    if not overrides:
        return LoadedScenario(build(document, file), name, text)
    # An override's value may hold earlier names too.
    document = rename_keys(apply_overrides(document, overrides), file)
    return LoadedScenario(build(document, file), name, write_document(document.data))


def _load_world(document: Document, name: str, family: FamilySource) -> LoadedScenario:
    before = [text for text in family.overrides if text.partition("=")[0].split(".")[0].strip() in DRAW_KEYS]
    after = [text for text in family.overrides if text not in before]
    document = draw_world(rename_keys(apply_overrides(document, before), family.file), family.file)
    document = rename_keys(apply_overrides(document, after), family.file)
    return LoadedScenario(build(document, family.file), name, write_document(document.data), family)


@lru_cache(maxsize=4)  # a log is opened several times, and hundreds of robots take a second to parse
def parse_scenario(yaml_text: str, file: str = "<scenario>") -> Scenario:
    """Return the scenario in a YAML text, as a log embeds it; `file` is for the errors. Raises InputError."""
    return build(_document(yaml_text, file), file, to_run=False)


@lru_cache(maxsize=8)  # a study runs the same text again and again, and reading YAML takes as long as a short run
def _document(text: str, file: str) -> Document:
    document = read_document(text, file)
    if document.data is None:
        raise InputError("is empty; allowed: a scenario in YAML", file=file, line=1)
    if not isinstance(document.data, dict):
        raise InputError(
            f"is no scenario: its top level is {yaml_text(document.data)}; allowed: keys and values in YAML",
            file=file,
            line=1,
        )
    return rename_keys(document, file)


def read_text(path: Path) -> str:
    """Return the text of a YAML file. Raises InputError when it cannot be read, is too large or no UTF-8."""
    try:
        with _opened(path) as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(path)) from None
    if len(content) > MOST_BYTES:
        raise InputError(TOO_LARGE, file=str(path))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError("is not UTF-8 text", file=str(path), line=line) from None


def _opened(path: Path) -> BinaryIO:
    if not path.is_fifo():
        return path.open("rb")
    # A pipe that nobody writes into is empty; to open it as files are opened would wait for a writer.
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(number, True)
    return os.fdopen(number, "rb")
