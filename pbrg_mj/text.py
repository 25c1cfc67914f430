"""Text for people: numbers with their nouns, and text from files made safe to show."""

from __future__ import annotations

import re
from html import escape

# Of Markdown within a line; an underscore between letters or digits is one.
MARKUP = re.compile(r"[\\`*~\[\]]|(?<![^\W_])_|_(?![^\W_])")


def counted(number: int, noun: str) -> str:
    """Return the number and the noun, with an s unless it is one: 1 run, 2 runs."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def format_significant(value: float, digits: int, sign: str = "") -> str:
    """Return `value` to so many significant digits, with an exponent only below 1e-4 and from 1e15 on: 6020, -0.0294.

    `sign` is that of a format: `+` shows the sign of numbers above 0 as well.
    """
    text = f"{value:{sign}.{digits}g}"
    return f"{float(text):{sign}.0f}" if "e+" in text and abs(value) < 1e15 else text


def plain(text: str, *, keep: str = "") -> str:
    r"""Return `text` with all that is not printable spelt out (`\x1b`), but for the characters in `keep`.

    Names and messages come from files that anybody may have written; a terminal must not act on them.
    """
    return "".join(c if c in keep or c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def markdown_text(text: str) -> str:
    """Return `text` within a line of Markdown that shows it as it is: no HTML, no link, no emphasis, no code.

    In a cell of a table `|` needs a backslash besides.
    """
    return MARKUP.sub(r"\\\g<0>", escape(" ".join(text.splitlines()), quote=False))


def markdown_code(text: str) -> str:
    """Return `text` as code in one line of Markdown, between more backticks than it has side by side itself."""
    longest = max(map(len, re.findall("`+", text)), default=0)
    fence, space = "`" * (longest + 1), " " if longest else ""
    return fence + space + " ".join(text.splitlines()) + space + fence
