"""What works on this machine."""

from __future__ import annotations

import os
import platform
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pbrg_mj.plugins import IN_SCENARIOS, Kind, installed
from pbrg_mj.scenario.robots import ROBOTS, RobotName
from pbrg_mj.video.gl import PACKAGES, probe_gl

REQUIRED = (
    "mujoco",
    "numpy",
    "scipy",
    "threadpoolctl",
    "cvxpy",
    "clarabel",
    "mcap",
    "mcap-protobuf-support",
    "foxglove-schemas-protobuf",
    "foxglove-sdk",
    "protobuf",
    "numba",
    "pydantic",
    "ruamel.yaml",
    "typer",
    "rich",
    "lz4",
    "zstandard",
    "websockets",
    "pyarrow",
    "joblib",
)
OPTIONAL = {
    "matplotlib": ("pbrg plot", "pip install matplotlib"),
    "av": ("pbrg render", "pip install av"),
    "xarray": ("Run.to_xarray", "pip install xarray"),
    "distributed": ("pbrg sweep --backend dask", "pip install distributed"),
    "optuna": ("pbrg tune, pbrg falsify", "pip install optuna"),
    "gymnasium": ("pbrg_mj.environments", "pip install gymnasium"),
    "pettingzoo": ("pbrg_mj.environments", "pip install pettingzoo"),
}


def doctor() -> dict[str, Any]:
    """Return versions, cores, GL, caches, robots and parts as plain data: what works, and how to fix what does not."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "required": {name: _version(name) for name in REQUIRED},
        "optional": {
            name: {"version": _version(name), "use": use, "fix": fix} for name, (use, fix) in OPTIONAL.items()
        },
        "gl": {backend: probe_gl(backend) for backend in PACKAGES},
        "numba_cache": _numba_cache(),
        "robots": {name: _robot(name) for name in ROBOTS},
        "parts": {kind.key: _parts(kind) for kind in IN_SCENARIOS},
    }


def _parts(kind: Kind) -> dict[str, str]:
    """Return the names that a scenario may give for a kind of part, with the packages that offer them."""
    found = dict.fromkeys(kind.built_in, "pbrg-mj")
    for one in (kind, kind.other):
        for name, entry in (installed(one) if one else {}).items():
            found[name] = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an installed package"
    return found


def _robot(name: RobotName) -> dict[str, Any]:
    """Return what a bundled robot is, and the numbers of its model."""
    from pbrg_mj.world.scene.robot import load_robot_model

    robot = load_robot_model(name)
    return {
        "description": ROBOTS[name],
        "mass_kg": robot.mass,
        "radius_m": robot.body_radius,
        "top_speed_m_s": robot.loaded_speed * robot.wheel_radius,
        "time_constant_s": robot.time_constant,
    }


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numba_cache() -> dict[str, Any]:
    """Return the folder where compiled kernels are kept."""
    from pbrg_mj.kernel import cache_folder

    folder = cache_folder()
    return {"folder": str(folder), "writable": _writable(folder)}


def _writable(folder: Path) -> bool:
    """Return whether a file can be made in `folder`, or in the nearest folder above it that is there."""
    there = next((place for place in (folder, *folder.parents) if place.is_dir()), None)
    try:
        with tempfile.TemporaryFile(dir=there):
            return there is not None
    except OSError:
        return False
