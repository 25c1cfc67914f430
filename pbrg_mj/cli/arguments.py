"""Arguments that several commands take."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def _bundled(incomplete: str) -> list[str]:
    """Return the bundled scenarios that begin so, for the shell to complete; files are the shell's own business."""
    from pbrg_mj.api.scenario import bundled_names

    return [name for name in bundled_names() if name.startswith(incomplete)]


ScenarioName = Annotated[
    str,
    typer.Argument(metavar="SCENARIO", help="A file, or a bundled name (see: pbrg list).", autocompletion=_bundled),
]
ScenarioNames = Annotated[
    list[str], typer.Argument(metavar="FILE...", help="Scenario files, or bundled names.", autocompletion=_bundled)
]
BundledName = Annotated[
    str, typer.Argument(metavar="NAME", help="A bundled name (see: pbrg list), or a file.", autocompletion=_bundled)
]
FamilyName = Annotated[
    str, typer.Argument(metavar="FAMILY", help="A family's file, or a bundled name.", autocompletion=_bundled)
]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change path.to.key; may be repeated.")
]
Duration = Annotated[float | None, typer.Option(help="Simulated time [s]: --set timing.duration=S.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite what exists.")]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="The log to read.")]


def ignore_mujoco_gl() -> None:
    """Forget MUJOCO_GL: where it names a library that is missing, MuJoCo would not even start, and nothing draws."""
    os.environ.pop("MUJOCO_GL", None)
