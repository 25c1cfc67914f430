"""Whether there is a log to read; checked before anything that takes long is imported."""

from __future__ import annotations

from pathlib import Path

from pbrg_mj.errors import InputError
from pbrg_mj.log.write.log_file import partial_path


def check_exists(path: Path) -> None:
    """Raise InputError when there is no such file, or it is a folder or a device."""
    if not path.exists():
        partial = partial_path(path)
        kept = f"; what a run that was killed, or goes on, has written is in {partial}: see `pbrg repair`"
        raise InputError(f"there is no such file{kept if partial.is_file() else ''}", file=str(path))
    if not path.is_file():
        raise InputError("this is not a file but a folder or a device; give a log", file=str(path))
