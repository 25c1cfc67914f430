"""What the numbers of a run depend on besides its scenario."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

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
    """Return name -> version of Python, the platform and the packages a run's numbers depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        try:
            found[package.replace("pbrg-mj", "pbrg_mj")] = version(package)
        except PackageNotFoundError:  # a checkout that was never installed
            found[package.replace("pbrg-mj", "pbrg_mj")] = "not installed"
    return found
