"""A study's own YAML file: safe, strict, and wrong in one line with file, line and key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from pbrg_mj.api.files import check_study_file
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import KeyPath, dotted_key, yaml_text
from pbrg_mj.scenario.families.checks import check_distributions
from pbrg_mj.scenario.load import read_text
from pbrg_mj.scenario.parse.document import Document, read_document
from pbrg_mj.scenario.parse.renamed_keys import Renamed, rename_keys
from pbrg_mj.scenario.parse.validation import first_error, origin, read_section
from pbrg_mj.scenario.schema.base import Section

Keys = TypeVar("Keys", bound=Section)


@dataclass(frozen=True)
class StudyFile(Generic[Keys]):
    """What a study's file holds, and where."""

    path: Path
    keys: Keys
    document: Document
    content: bytes

    @property
    def folder(self) -> Path:
        """Where files that it names are sought."""
        return self.path.parent

    def error(self, path: KeyPath, message: str) -> InputError:
        """Return the error of an entry."""
        line = origin(path, self.document)
        return InputError(
            message, file=str(self.path), line=line if isinstance(line, int) else None, key=dotted_key(path)
        )


def read_study(path: str | Path, kind: type[Keys], renamed: Renamed | None = None) -> StudyFile[Keys]:
    """Return the file's keys, those that have other names today as `renamed` says. Raises InputError."""
    path = Path(path)
    check_study_file(path)
    text, file = read_text(path), str(path)
    document = read_document(text, file)
    if not isinstance(document.data, dict):
        raise InputError(f"is {yaml_text(document.data)}; allowed: keys and values in YAML", file=file, line=1)
    document = rename_keys(document, file, renamed or {})
    keys = read_section(kind, document.data, document, file)
    if wrong := list(check_distributions(keys)):
        raise first_error(wrong, document, file)
    return StudyFile(path, keys, document, text.encode())


def plain(value: Any) -> Any:
    """Return lists for tuples: values as they stood in the file."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value
