"""Text for people: numbers with their nouns, and text from files made safe to show."""

from __future__ import annotations


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
