"""Which way of drawing without a display works here.

`import mujoco` itself dies when MUJOCO_GL names a library that is missing. So the variable is never set in this
process: backends are probed, and pictures drawn, in processes of their own.
"""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

from pbrg_mj.errors import InputError

PACKAGES = {"egl": ("libegl1", "libgl1"), "osmesa": ("libosmesa6",)}  # of Debian, by backend, best first
PROBE = "import mujoco; context = mujoco.GLContext(64, 64); context.make_current(); context.free()"
PROBE_TIMEOUT = 30.0  # [s]


def environment(backend: str) -> dict[str, str]:
    """Return the environment of a process that draws with `backend` and imports what this process imports."""
    # No platform left over from elsewhere may decide instead of the backend asked for.
    inherited = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    path = os.pathsep.join(place for place in sys.path if place)
    return inherited | {"MUJOCO_GL": backend, "PYTHONPATH": path}


def probe_gl(backend: str) -> dict[str, Any]:
    """Try to make a context; return whether it works, the error if not, and the packages that bring it."""
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", PROBE],
            env=environment(backend),
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
    return {"works": works, "error": error, "packages": list(PACKAGES[backend])}


def working_backend() -> str:
    """Return the first backend that works. Raises InputError, naming what to install, when none does."""
    for backend in PACKAGES:
        if probe_gl(backend)["works"]:
            return backend
    choices = ", or ".join(f"apt install {' '.join(packages)}" for packages in PACKAGES.values())
    raise InputError(f"no GL to draw with (neither EGL nor OSMesa works); on Debian: {choices}")
