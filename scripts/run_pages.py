"""Run the commands that stand in pages, and write what they print now below them.

python scripts/run_pages.py [PAGE ...]           # the tutorial and the how-to pages, unless pages are named
python scripts/run_pages.py --check [PAGE ...]   # exit with 1 if commands print something of another kind by now

A command is a line `    $ ...`; its output follows it. Where a line of output is `...`, the lines beside it are looked
up in the command's output by their first words, or by the most similar ones where those have changed. A page with a
line that is like nothing printed now stays as it is, and the exit code is 1. A fenced block that begins with a comment
that is a file's name is that file. A page's commands run one after another in a folder of their own.
"""

from __future__ import annotations

import re
import sys
import tempfile
from difflib import get_close_matches
from pathlib import Path

from make_command_docs import EVENT, run, words

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = (DOCS / "tutorial.md", *sorted((DOCS / "how-to").glob("*.md")))
FILE = re.compile(r"^```\w+\n# ([\w-]+\.\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"(?:^    .*\n)(?:^    .*\n|^\n(?=    ))*", re.MULTILINE)


class GoneError(Exception):
    """A line that a page shows stands for nothing that its command prints."""


def refreshed(text: str) -> str:
    """Return a page with what its commands print now."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, content in FILE.findall(text):
            (folder / name).write_text(content, encoding="utf-8")
        return BLOCK.sub(lambda block: _block(block.group(), folder), text)


def _block(block: str, folder: Path) -> str:
    lines = [line.removeprefix("    ") for line in block.splitlines()]
    if not any(line.startswith("$ ") for line in lines):
        return block
    starts = [k for k, line in enumerate(lines) if line.startswith("$ ")]
    shown: list[str] = []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        command = lines[start].removeprefix("$ ").partition("  #")[0]
        before = lines[start + 1 : end]
        now = run(command.rstrip(), folder).splitlines()[1:]
        shown += [lines[start], *(_elided(before, now) if "..." in before else now)]
    return "".join(f"    {line}".rstrip() + "\n" for line in shown)


def _elided(before: list[str], now: list[str]) -> list[str]:
    """Return the lines of `now` that stand in `before`, in their order; `...` stays."""
    shown, position = [], 0
    for line in before:
        labels = [_label(other) for other in now[position:]]
        if line == "...":
            shown.append(line)
        else:
            position += labels.index(_nearest(_label(line), labels)) + 1
            shown.append(now[position - 1])
    return shown


def _nearest(label: str, labels: list[str]) -> str:
    """Return the label itself if it is there, else the one most like it. Raises GoneError when none is like it."""
    if label in labels:
        return label
    alike = get_close_matches(label, labels, n=1)
    if not alike:
        raise GoneError(f"{label!r} is no longer printed; choose another line for the page")
    return alike[0]


def _label(line: str) -> str:
    """Return what a line is about: its first words, without numbers."""
    return EVENT.sub("", re.split(r"  +", line.strip())[0])


def main() -> int:
    """Write or check the pages."""
    named = [Path(name).resolve() for name in sys.argv[1:] if not name.startswith("--")]
    differing: list[str] = []
    for page in named or PAGES:
        text = page.read_text(encoding="utf-8")
        try:
            now = refreshed(text)
        except GoneError as error:
            print(f"{page.name}: {error}", file=sys.stderr)
            return 1
        if "--check" not in sys.argv:
            page.write_text(now, encoding="utf-8")
        ours, theirs = words(text), words(now)
        differing += [f"{page.name}: - {line}" for line in ours if line not in theirs]
        differing += [f"{page.name}: + {line}" for line in theirs if line not in ours]
    if "--check" in sys.argv and differing:
        print("\n".join(["pages are out of date: run scripts/run_pages.py", *differing]), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
