"""Text for people: numbers with their nouns, and text from files made safe to show."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """Return the number and the noun, with an s unless it is one: 1 run, 2 runs."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def plain(text: str, *, keep: str = "") -> str:
    r"""Return `text` with all that is not printable spelt out (`\x1b`), but for the characters in `keep`.

    Names and messages come from files that anybody may have written; a terminal must not act on them.
    """
    return "".join(c if c in keep or c.isprintable() else c.encode("unicode_escape").decode() for c in text)
