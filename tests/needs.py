"""What a test needs beside this package. Elsewhere it is skipped without; in CI, which installs all of it, it fails."""

from __future__ import annotations

import importlib
import os
from typing import Any

import pytest

IN_CI = os.environ.get("CI", "").lower() in ("1", "true")


def need(there: object, what: str) -> None:
    """Go on only where `what` is there."""
    if not there:
        (pytest.fail if IN_CI else pytest.skip)(f"needs {what}")


def need_module(name: str) -> Any:
    """Return a module of an extra; for modules of tests, too, before their first test."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        if IN_CI:
            raise
        pytest.skip(f"needs {name}: {error}", allow_module_level=True)
