"""What is wrong with a scenario, and the one line that says so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.document import Document
from pbrg_mj.scenario.words import Path, dotted


@dataclass(frozen=True)
class Finding:
    """One thing wrong: the path of the key, and a message with the value and what is allowed."""

    path: Path
    message: str


def first_error(findings: Sequence[Finding], document: Document, file: str) -> InputError:
    """Return the error that tells the first finding, and how many more there are.

    First are those that an override caused, then those of the file in the order of its lines.
    """
    origins = [_origin(finding.path, document) for finding in findings]
    order = [0 if isinstance(origin, str) else origin for origin in origins]
    first = min(range(len(findings)), key=lambda k: (order[k], k))
    finding, origin = findings[first], origins[first]
    more = f" (and {len(findings) - 1} more)" if len(findings) > 1 else ""
    if isinstance(origin, str):
        return InputError(f"{finding.message}; set by override {origin!r}{more}", key=dotted(finding.path))
    return InputError(finding.message + more, file=file, line=origin, key=dotted(finding.path))


def _origin(path: Path, document: Document) -> int | str:
    """Return where the entry came from, or the nearest section around it when it stands nowhere itself."""
    for length in range(len(path), -1, -1):
        if path[:length] in document.origins:
            return document.origins[path[:length]]
    return 1
