"""Which file a scenario's name means."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_families, bundled_scenarios
from pbrg_mj.scenario.diagnostics import yaml_text


def find_scenario(source: str | Path) -> tuple[Path, str]:
    """Return the file, and the scenario's name. A file goes before a bundled scenario of the same name.

    Raises InputError when it is neither a file nor a bundled name.
    """
    if not str(source):
        raise InputError("the scenario's name is empty; allowed: a file, or a bundled name (see: pbrg list)")
    path = Path(source)
    if _exists(path) and not path.is_dir():
        return path, os.fsencode(path.stem).decode("utf-8", "backslashreplace")  # as it stands in logs, in UTF-8
    bundled = bundled_scenarios() | bundled_families()
    name = path.as_posix().removesuffix(".yaml")
    if name in bundled:
        return bundled[name], name
    if _exists(path):
        raise InputError("is a folder; allowed: a scenario's YAML file", file=str(path))
    near = difflib.get_close_matches(name, bundled, n=1)
    hint = f"did you mean {near[0]}?" if near else "see: pbrg list"
    raise InputError(f"{yaml_text(str(source))} is neither a file nor a bundled scenario; {hint}")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long, a folder that may not be searched
        return False
