"""Where the bundled models, scenarios and families are: inside an installed wheel, or at the top of a checkout."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

PACKAGE = Path(__file__).resolve().parents[1]
FAMILIES = "families"  # the folder among the scenarios that holds them

# The paper's runs, in the folder `paper`.
PAPER_RUNS = ("simulation_near", "simulation_inadmissible", "experiment_near", "experiment_inadmissible")


def data_dir(kind: Literal["models", "scenarios"]) -> Path:
    """Return the folder of the bundled models or scenarios.

    Raises FileNotFoundError when the installation is broken.
    """
    installed = PACKAGE / "_data" / kind
    if installed.is_dir():
        return installed
    checkout = PACKAGE.parent
    # Beside an installed package stand other people's packages: only a project's top level counts.
    if (checkout / "pyproject.toml").is_file() and (checkout / kind).is_dir():
        return checkout / kind
    raise FileNotFoundError(f"no bundled {kind}: neither {installed} nor {checkout / kind} is there")


def bundled_scenarios() -> dict[str, Path]:
    """Return every bundled scenario's file by its name, such as `paper/experiment_near`, sorted by name."""
    return {name: path for name, path in _bundled().items() if not name.startswith(f"{FAMILIES}/")}


def bundled_families() -> dict[str, Path]:
    """Return every bundled family's file by its name, such as `families/boxes`, sorted by name."""
    return {name: path for name, path in _bundled().items() if name.startswith(f"{FAMILIES}/")}


def bundled_file(name: str) -> Path | None:
    """Return the file of the bundled scenario or family of that name, whatever files there are beside; None without."""
    return _bundled().get(name)


def _bundled() -> dict[str, Path]:
    root = data_dir("scenarios")
    found = {path.relative_to(root).with_suffix("").as_posix(): path for path in root.rglob("*.yaml")}
    return dict(sorted(found.items()))
