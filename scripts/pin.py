"""Write constraints.txt anew: every package's version, the hashes of its archives, and the extras that need it.

    python scripts/pin.py             # keep the versions that are there; pin what pyproject.toml needs beyond them
    python scripts/pin.py --upgrade   # take the newest versions that go together

Needs `uv` on the PATH, and an index (UV_INDEX_URL, where it is not PyPI); no address gets into the file. Hashes are
those of all archives that the index has of a version, for every platform.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

TOP = Path(__file__).resolve().parents[1]
FILE = TOP / "constraints.txt"
PYTHONS = ("3.11.9", "3.12", "3.13", "3.14")
BUILD = ("hatchling", "editables")  # what an editable install of the project itself takes
HEADER = """\
# Tested versions of all packages, with the hashes of their archives. Written by python scripts/pin.py.
# ./scripts/setup installs the sections `all` and those of the extras asked for.
"""


def compiled(source: str, *options: str) -> str:
    """Return what `uv pip compile` makes of the lines of a requirements file."""
    command = ["uv", "pip", "compile", "-", "--quiet", "--no-config", "--no-header", "--no-annotate", *options]
    return subprocess.run(command, cwd=TOP, input=source, capture_output=True, text=True, check=True).stdout


def needed(requirements: list[str], pins: str) -> set[str]:
    """Return `name==version` of all packages that requirements need on any Python, on Linux."""
    found: set[str] = set()
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write(pins)
        file.flush()
        for python in PYTHONS:
            options = ("--constraint", file.name, "--python-version", python, "--python-platform", "linux")
            found.update(compiled("\n".join(requirements), *options).split())
    return found


def sections(pins: str) -> dict[str, set[str]]:
    """Return `name==version` of all packages by the extras that need them: `all`, or names with blanks between."""
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    always = [*project["dependencies"], *BUILD]
    everything = always + [one for extra in project["optional-dependencies"].values() for one in extra]
    pins = "\n".join(sorted(needed(everything, pins)))  # so that all extras get versions that go together
    base = needed(always, pins)
    extras = {name: needed(always + own, pins) - base for name, own in project["optional-dependencies"].items()}
    found = {"all": base}
    for package in sorted(set().union(*extras.values()), key=str.lower):
        found.setdefault(" ".join(name for name, own in extras.items() if package in own), set()).add(package)
    return found


def main() -> int:
    pinned = re.findall(r"^[\w.-]+==[^\s\\]+", FILE.read_text(encoding="utf-8"), re.MULTILINE)
    text, options = HEADER, ("--no-deps", "--generate-hashes", "--python-version", PYTHONS[0])
    for extras, packages in sections("" if "--upgrade" in sys.argv[1:] else "\n".join(pinned)).items():
        text += f"\n# for {extras}\n" + compiled("\n".join(sorted(packages, key=str.lower)), *options)
    FILE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
