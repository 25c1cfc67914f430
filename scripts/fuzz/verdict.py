"""Whether a command may end so: exit code 0, 1 or 2, in time, in memory, with lines that a person reads."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Sequence
from dataclasses import dataclass

from scripts.fuzz.sandbox import CPU, ESCAPED, MEMORY, Ending

STARTS = ("error: ", "warning: ")  # of lines on stderr


@dataclass(frozen=True)
class Failure:
    """What went wrong with one case."""

    seed: int
    kind: str  # in a few words, alike for what is alike
    command: str  # that reproduces it
    detail: str


def fault(
    ending: Ending, left: Sequence[str] = (), json_wanted: bool = False, all_told: bool = False
) -> tuple[str, str] | None:
    """Return what is wrong with an ending, as a kind and details; None if nothing is.

    `left` are the files that the command left behind. Where `all_told`, as many errors follow the first as it says.
    """
    lines = ending.stderr.splitlines()
    last = lines[-1][:300] if lines else ""
    errors = [line for line in lines if line.startswith("error: ")]
    stray = [line for line in lines if not line.startswith(STARTS)]
    if ending.signal in (signal.SIGXCPU, signal.SIGKILL) or ending.cpu_s > CPU:
        return "time", f"{ending.cpu_s:.1f} s of CPU; {last}"
    if ending.signal is not None:
        return f"signal {ending.signal}", last
    if ending.memory_bytes > MEMORY or "error: out of memory" in ending.stderr:  # of what the sandbox allows
        return "memory", f"{ending.memory_bytes / 2**20:.0f} MiB; {last}"
    if ending.code == ESCAPED:
        return f"traceback: {last.split(':')[0]}", _place(lines)
    if ending.code not in (0, 1, 2):
        return f"exit {ending.code}", last
    if stray:
        return "stray line on stderr", stray[0][:300]
    asked = (1 + _announced(errors) if all_told else 1) if ending.code == 2 else 0
    if len(errors) != asked and not (ending.code == 1 and len(errors) <= 1):
        return "lines that begin with error", f"{len(errors)} with exit {ending.code}: {last}"
    if ending.code == 2 and left:
        return "left behind", ", ".join(left)
    if json_wanted and ending.code in (0, 1) and not errors and not _is_json(ending.stdout):
        return "no JSON", ending.stdout[:200]
    return None


def _announced(errors: Sequence[str]) -> int:
    """Return how many more errors the first one says that there are."""
    found = re.search(r" \(and (\d+) more\)$", errors[0]) if errors else None
    return int(found[1]) if found else 0


def _place(lines: Sequence[str]) -> str:
    """Return where a traceback ends, and what it says."""
    places = [line.strip() for line in lines if line.lstrip().startswith("File ")]
    ours = [place for place in places if "pbrg_mj" in place]
    return f"{(ours or places or ['?'])[-1]}; {lines[-1][:300]}"


def _is_json(text: str) -> bool:
    try:
        json.loads(text, parse_constant=lambda name: 1 / 0)
    except (ValueError, ZeroDivisionError):
        return False
    return True
