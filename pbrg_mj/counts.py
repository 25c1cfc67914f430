"""Numbers with their nouns, as a sentence has them: 1 run, 2 runs."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """Return the number and the noun, with an s unless it is one."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
