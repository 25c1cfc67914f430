"""What the numbers of a run depend on besides its scenario."""

from __future__ import annotations

import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pbrg_mj

PACKAGES = (
    "pbrg-mj",
    "mujoco",
    "numpy",
    "scipy",
    "numba",
    "cvxpy",
    "clarabel",
    "pydantic",
    "ruamel.yaml",
    "mcap",
    "zstandard",
    "protobuf",
    "foxglove-schemas-protobuf",
)


def versions() -> dict[str, str]:
    """Return name -> version of Python, the platform, the processor and the packages a run's numbers depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform(), "processor": processor()}
    for package in PACKAGES:
        try:
            found[package.replace("pbrg-mj", "pbrg_mj")] = version(package)
        except PackageNotFoundError:  # a checkout that was never installed
            found[package.replace("pbrg-mj", "pbrg_mj")] = "not installed"
    found["pbrg_mj.code"] = code_digest()
    return found


def code_digest() -> str:
    """Return a digest of this package's own code: a checkout changes without a new version."""
    folder = Path(pbrg_mj.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def processor() -> str:
    """Return the processor's name as the system tells it: compiled code takes other paths on another one."""
    try:
        named = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:  # not a Linux
        named = None
    return named[1] if named else platform.processor() or platform.machine()
