"""The findings behind `pbrg doctor`."""

from __future__ import annotations

import os
import platform
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pbrg_mj
from pbrg_mj.video.gl import PACKAGES, probe_gl

REQUIRED = (
    "mujoco",
    "numpy",
    "scipy",
    "cvxpy",
    "clarabel",
    "mcap",
    "mcap-protobuf-support",
    "foxglove-schemas-protobuf",
    "protobuf",
    "numba",
    "pydantic",
    "ruamel.yaml",
    "typer",
    "rich",
    "zstandard",
)
OPTIONAL = {
    "matplotlib": ("pbrg plot", "pip install 'pbrg-mj[plot]'"),
    "av": ("pbrg render", "pip install 'pbrg-mj[video]'"),
}


def checkup() -> dict[str, Any]:
    """Return everything found, as plain data."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "required": {name: _version(name) for name in REQUIRED},
        "optional": {
            name: {"version": _version(name), "use": use, "mend": mend} for name, (use, mend) in OPTIONAL.items()
        },
        "gl": {backend: probe_gl(backend) for backend in PACKAGES},
        "numba_cache": _numba_cache(),
    }


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numba_cache() -> dict[str, Any]:
    """Return the folder where numba keeps compiled kernels: its own choice is beside the code, else the user's."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba"
    folders = [Path(chosen)] if chosen else [Path(pbrg_mj.__file__).parent, user]
    for folder in folders:
        if _writable(folder):
            return {"folder": str(folder), "writable": True}
    return {"folder": str(folders[-1]), "writable": False}


def _writable(folder: Path) -> bool:
    """Tell whether a file can be made in `folder`, or in the nearest folder above it that is there."""
    there = next((place for place in (folder, *folder.parents) if place.is_dir()), None)
    try:
        with tempfile.TemporaryFile(dir=there):
            return there is not None
    except OSError:
        return False
