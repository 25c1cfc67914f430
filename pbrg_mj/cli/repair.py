"""`pbrg repair`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrg_mj.cli.console import emit, note
from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.log.repair import RepairReport


def repair(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The damaged log; it stays as it is.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.mcap", help="The clean log to write.")],
) -> None:
    """Write a clean log of all that is whole in a damaged one."""
    from pbrg_mj.analysis.output_file import by_suffix, write_atomically
    from pbrg_mj.log.repair import repair as write

    by_suffix(output, {".mcap": None})
    if output.exists() and log.exists() and output.samefile(log):
        raise InputError("would overwrite the log itself; give another name", file=str(output))
    found: list[RepairReport] = []
    write_atomically(output, lambda path: found.append(write(log, path)))
    if found[0].damage:
        note(f"warning: {log}: {_told_once(found[0].damage)}")
    emit("\n".join(_lines(found[0], output)))


def _told_once(damage: Sequence[str]) -> str:
    """Return all damage in one line, what occurs more than once with its count."""
    counts = Counter(damage)
    return "; ".join(f"{what} ({count} times)" if count > 1 else what for what, count in counts.items())


def _lines(found: RepairReport, output: Path) -> list[str]:
    lost = f", {found.lost} left out" if found.lost else ""
    lines = [f"{output}: {found.kept_ticks} ticks in {found.chunks} chunks{lost}"]
    if found.ticks[0][0] > 0:
        lines.append("its first ticks are lost: MCAP viewers open it, the other commands need tick 0")
    elif len(found.ticks) > 1:
        after, before = found.ticks[0][1], found.ticks[1][0]
        lines.append(f"ticks {after + 1} to {before - 1} are lost: MCAP viewers see the rest, other commands end there")
    return lines
