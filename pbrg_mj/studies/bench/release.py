"""Released results: a manifest of a benchmark's folder, by which every file is known again."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from pbrg_mj.analysis.output_file import write_atomically
from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.studies.bench.bench import FILES, TABLE
from pbrg_mj.studies.records import RECORDS
from pbrg_mj.studies.run_task import MACHINE
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted

MANIFEST, FORMAT = "release.json", 1
SHOWN = 3  # files that an error names


@dataclass(frozen=True)
class Release:
    """A released folder."""

    path: Path  # the manifest
    sha256: str  # of the manifest, which has those of all files: one number to publish with the results
    files: int  # how many

    def __str__(self) -> str:
        """Return a line."""
        return f"{self.path}: {counted(self.files, 'file')}, SHA-256 {self.sha256}"


def release_bench(folder: str | Path) -> Release:
    """Write `release.json` into the folder of a finished benchmark: SHA-256 of every file, and what made the logs.

    The same files give the same manifest, byte for byte, wherever the folder lies. `verify_bench` checks it first.
    Raises InputError when the folder has no table, records or logs, when its logs are of several versions of the code,
    or for what is no regular file.
    """
    folder = Path(folder)
    files = _files(folder)
    for needed in (TABLE, RECORDS):
        if needed not in files:
            raise InputError(f"has no {needed}; allowed: the folder of a finished `pbrg bench`", file=str(folder))
    if not any(name in files for name in FILES.values()):
        raise InputError(f"has no suite; required: one of {', '.join(FILES.values())}", file=str(folder))
    digests = {name: _digest(path) for name, path in files.items()}
    if links := [name for name, digest in digests.items() if digest is None]:
        raise InputError("is a link or no file; allowed in a release: files", file=str(folder / links[0]))
    versions, machines = _made_by([path for name, path in files.items() if name.startswith(f"{LOGS}/")], folder)
    manifest = {"format": FORMAT, "versions": versions, "machines": machines, "files": digests}
    content = (json.dumps(manifest, indent=1, sort_keys=True) + "\n").encode()
    write_atomically(folder / MANIFEST, lambda path: _write(path, content))
    return Release(folder / MANIFEST, hashlib.sha256(content).hexdigest(), len(files))


def check_release(folder: Path) -> Release | None:
    """Compare the folder's files with its manifest; None if it has none.

    Raises PbrgError when one of them differs, is missing or was added, InputError when the manifest is wrong.
    """
    path = folder / MANIFEST
    if not path.is_file():
        return None
    content = path.read_bytes()
    expected, found = _read(content, path), _files(folder)
    wrong = [f"{name} is missing" for name in sorted(expected.keys() - found.keys())]
    wrong += [f"{name} was added" for name in sorted(found.keys() - expected.keys())]
    both = sorted(expected.keys() & found.keys())
    wrong += [f"{name} differs" for name in both if _digest(found[name]) != expected[name]]
    if wrong:
        more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
        raise PbrgError(f"{path}: not the files that were released: {', '.join(wrong[:SHOWN])}{more}")
    return Release(path, hashlib.sha256(content).hexdigest(), len(found))


def _files(folder: Path) -> dict[str, Path]:
    """Return all that lies in the folder but folders and the manifest, by its place; links are not followed."""
    paths = (path for path in sorted(folder.rglob("*")) if path.is_symlink() or not path.is_dir())
    named = {path.relative_to(folder).as_posix(): path for path in paths}
    named.pop(MANIFEST, None)
    return named


def _digest(path: Path) -> str | None:
    """Return a file's SHA-256; None for a link, and for what is no file."""
    if path.is_symlink() or not path.is_file():
        return None
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _made_by(logs: list[Path], folder: Path) -> tuple[dict[str, str], list[dict[str, str]]]:
    """Return the versions that made the logs, the same for all of them, and the kinds of machine."""
    if not logs:
        raise InputError("has no logs; allowed: the folder of a finished `pbrg bench`", file=str(folder))
    versions: dict[str, str] = {}
    machines: set[tuple[str, ...]] = set()
    for log in logs:
        here = read_header(log).versions
        machines.add(tuple(here.pop(name, "") for name in MACHINE))
        if here != (versions := versions or here):
            changed = sorted(name for name in {*here, *versions} if here.get(name) != versions.get(name))
            raise InputError(f"was made with another {', '.join(changed)} than {logs[0].name}", file=str(log))
    return versions, [dict(zip(MACHINE, one, strict=True)) for one in sorted(machines)]


def _read(content: bytes, path: Path) -> dict[str, str]:
    """Return the manifest's digests by file. Raises InputError."""
    try:
        data: Any = json.loads(content)
    except (ValueError, RecursionError):
        raise InputError("is no JSON", file=str(path)) from None
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("files"), dict):
        raise InputError(f"is no manifest of the format {FORMAT}, the one known here", file=str(path))
    for name, digest in data["files"].items():
        if not _is_inside(name):
            raise InputError("allowed: a place inside the folder, as logs/run.mcap", file=str(path), key=repr(name))
        if not isinstance(digest, str) or not re.fullmatch("[0-9a-f]{64}", digest):
            raise InputError("its SHA-256 is not 64 hexadecimal digits", file=str(path), key=repr(name))
    return data["files"]


def _is_inside(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return bool(parts) and name == "/".join(parts) and ".." not in parts


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
