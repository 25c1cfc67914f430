"""Released results: a manifest of a benchmark's folder, by which every file is known again."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from pbrg_mj.analysis.output_file import write_atomically
from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.digest import message_digest
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.studies.bench.bench import FILES, TABLE
from pbrg_mj.studies.records import RECORDS
from pbrg_mj.studies.run_task import MACHINE
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted

MANIFEST, FORMAT = "release.json", 1
MESSAGES = "messages"  # key of the digests of what logs say
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

    It has those of each log's messages, too, which logs made on another machine may share: `verify_bench` compares
    them. The same files give the same manifest, byte for byte, wherever the folder lies. `verify_bench` checks it
    first. Raises InputError when the folder has no table, records or whole logs, when its logs are of several versions
    of the code, or for what is no regular file.
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
    manifest = {"format": FORMAT, "files": digests, **_said_by_logs(files, folder)}
    content = (json.dumps(manifest, indent=1, sort_keys=True) + "\n").encode()
    write_atomically(folder / MANIFEST, lambda path: _write(path, content))
    return Release(folder / MANIFEST, hashlib.sha256(content).hexdigest(), len(files))


def check_release(folder: Path) -> Release | None:
    """Compare the folder's files with its manifest; None if it has none.

    Raises PbrgError when one of them differs, is missing or was added, or the manifest says else of the logs than they
    do, InputError when the manifest is wrong.
    """
    path = folder / MANIFEST
    if not path.is_symlink() and not path.exists():
        return None
    if path.is_symlink() or not path.is_file():
        raise InputError("is a link or no file; allowed: a manifest", file=str(path))
    content = path.read_bytes()
    manifest = _read(content, path)
    expected, found = _digests(manifest, "files", path), _files(folder)
    wrong = [f"{name} is missing" for name in sorted(expected.keys() - found.keys())]
    wrong += [f"{name} was added" for name in sorted(found.keys() - expected.keys())]
    both = sorted(expected.keys() & found.keys())
    wrong += [f"{name} differs" for name in both if _digest(found[name]) != expected[name]]
    if wrong:
        more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
        raise PbrgError(f"{path}: not the files that were released: {', '.join(wrong[:SHOWN])}{more}")
    said = _said_by_logs(found, folder)
    if other := sorted(key for key in said if manifest.get(key) != said[key]):
        raise PbrgError(f"{path}: not what the logs say: {', '.join(other)}")
    return Release(path, hashlib.sha256(content).hexdigest(), len(found))


def differing_logs(folder: Path, manifest: Path) -> Iterator[str]:
    """Yield a line for each log that a release elsewhere has with other messages, or one side has not.

    Raises InputError when the manifest cannot be read or is wrong.
    """
    try:
        content = manifest.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(manifest)) from None
    released = _digests(_read(content, manifest), MESSAGES, manifest)
    here = {name: path for name, path in _files(folder).items() if name.startswith(f"{LOGS}/")}
    for name in sorted(released.keys() | here.keys()):
        if name not in here:
            yield f"{name}: released, and not here"
        elif name not in released:
            yield f"{name}: is not among the released logs"
        elif _messages_of(here[name]) != released[name]:
            yield f"{name}: has other messages than the released log"


def _messages_of(log: Path) -> str | None:
    """Return the digest of a log's messages; None for what is no whole log."""
    try:
        return message_digest(log)
    except InputError:
        return None


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


def _said_by_logs(files: dict[str, Path], folder: Path) -> dict[str, Any]:
    """Return what a manifest has of the logs: their messages' digests, and what made them. Raises InputError."""
    logs = {name: path for name, path in files.items() if name.startswith(f"{LOGS}/")}
    versions, machines = _made_by(list(logs.values()), folder)
    messages = {name: message_digest(path) for name, path in logs.items()}
    return {"versions": versions, "machines": machines, MESSAGES: messages}


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


def _read(content: bytes, path: Path) -> dict[str, Any]:
    """Return a manifest. Raises InputError."""
    try:
        data: Any = json.loads(content)
    except (ValueError, RecursionError):
        raise InputError("is no JSON", file=str(path)) from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f"is no manifest of the format {FORMAT}, the one known here", file=str(path))
    return data


def _digests(manifest: dict[str, Any], key: str, path: Path) -> dict[str, str]:
    """Return the digests of `files`, or of `messages`, by file. Raises InputError."""
    digests = manifest.get(key)
    if not isinstance(digests, dict):
        raise InputError("is missing; required: SHA-256 by file", file=str(path), key=key)
    for name, digest in digests.items():
        if not _is_inside(name):
            raise InputError("allowed: a place inside the folder, as logs/run.mcap", file=str(path), key=repr(name))
        if not isinstance(digest, str) or not re.fullmatch("[0-9a-f]{64}", digest):
            raise InputError("its SHA-256 is not 64 hexadecimal digits", file=str(path), key=repr(name))
    return digests


def _is_inside(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return bool(parts) and name == "/".join(parts) and ".." not in parts


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
