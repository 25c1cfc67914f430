"""Files, scenarios and seeds that users name, checked at once: nothing slow is imported or computed before."""

from __future__ import annotations

from pathlib import Path

from pbrg_mj.analysis.output_file import by_suffix, check_place
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.existing import check_exists
from pbrg_mj.log.write.log_file import check_writable
from pbrg_mj.scenario.bundled import PAPER_RUNS as PAPER
from pbrg_mj.scenario.find import find_scenario

ARRAYS = (".npz", ".mat", ".csv")
FIGURES = (".pdf", ".png", ".svg")
PAGES = (".html", ".htm")
PICTURES = (".mp4", ".webm", ".gif", ".webp", ".png")


def log_path(path: str | Path, *, force: bool) -> Path:
    """Return the path of a log to write. Raises InputError when it is not .mcap, or may not or cannot be written."""
    path = Path(path)
    if path.suffix != ".mcap":
        raise InputError("a log's name ends in .mcap", file=str(path))
    check_writable(path, force=force)
    return path


def check_output(path: str | Path, suffixes: tuple[str, ...], *, force: bool) -> None:
    """Raise InputError for a name that ends in none of the suffixes, and where a file may not or cannot be made."""
    by_suffix(Path(path), dict.fromkeys(suffixes))
    check_place(Path(path))
    check_new(Path(path), force=force)


def check_new(path: Path, *, force: bool) -> None:
    """Raise InputError for a file that exists, unless `force` allows to replace it."""
    if path.is_file() and not force:
        raise InputError("exists; --force overwrites it", file=str(path))


def check_logs(*logs: str | Path) -> None:
    """Raise InputError for the first log that is not there, or is no file."""
    for log in logs:
        check_exists(Path(log))


def check_study_file(path: str | Path) -> None:
    """Raise InputError when the file of a study is not there, or is no file."""
    path = Path(path)
    if not path.is_file():
        raise InputError("is not there" if not path.exists() else "is no file", file=str(path))


def check_arrays(path: str | Path, *, force: bool) -> None:
    """Raise InputError when a batch's arrays may not or cannot be written here, or the name does not end in .npz."""
    by_suffix(Path(path), {".npz": None})
    check_writable(Path(path), force=force)


def check_paper_folder(folder: str | Path, *, force: bool) -> None:
    """Raise InputError when this is no folder, or the logs of the paper's runs may not or cannot be written in it."""
    folder = Path(folder)
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError("this is not a folder", file=str(folder))
    for name in PAPER:
        check_writable(folder / f"{name}.mcap", force=force)


def check_scenario(source: str | Path, seed: int | None = None) -> None:
    """Raise InputError when a scenario is neither a file nor a bundled one, or for a seed that none can have."""
    find_scenario(source)
    if seed is not None and not 0 <= seed < 2**63:
        raise InputError(f"--seed is {seed}; allowed: a whole number at least 0 and less than {2**63}")
