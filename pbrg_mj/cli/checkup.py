"""The findings behind `pbrg doctor`."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pbrg_mj

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
OPTIONAL = {"matplotlib": ("pbrg plot", "pip install 'pbrg-mj[plot]'")}
GL_PACKAGES = {"egl": ("libegl1", "libgl1"), "osmesa": ("libosmesa6",)}
GL_PROBE = "import mujoco; context = mujoco.GLContext(64, 64); context.make_current(); context.free()"
PROBE_TIMEOUT = 30.0  # [s]


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
        "gl": {backend: _probe_gl(backend) for backend in GL_PACKAGES},
        "numba_cache": _numba_cache(),
    }


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _probe_gl(backend: str) -> dict[str, Any]:
    """Try a context in a process of its own: with the variable set and the library missing, the import itself dies."""
    # No platform left over from elsewhere may decide instead of the backend asked for.
    environment = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    try:
        probe = subprocess.run(
            [sys.executable, "-c", GL_PROBE],
            env=environment | {"MUJOCO_GL": backend},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PROBE_TIMEOUT,
            check=False,
        )
        works, words = probe.returncode == 0, probe.stderr.strip().splitlines()
    except subprocess.TimeoutExpired:
        works, words = False, [f"no answer within {PROBE_TIMEOUT:g} s"]
    error = None if works else (words or ["it crashed"])[-1]
    return {"works": works, "error": error, "packages": list(GL_PACKAGES[backend])}


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
