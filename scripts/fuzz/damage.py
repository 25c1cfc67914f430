"""Accidents of bytes, and of texts with lines, indentation and YAML's own signs."""

from __future__ import annotations

import struct

from scripts.fuzz.values import Rng, pick

LENGTHS = (0, 1, 2**16, 2**31, 2**32 - 1, 2**32, 60 * 2**30, 2**63 - 1, 2**63, 2**64 - 1)
TOKENS = (
    "- ",
    ": ",
    "{",
    "}",
    "[",
    "]",
    "&a ",
    "*a",
    "<<: *a",
    "!!int ",
    "!!binary ",
    "|\n",
    ">\n",
    "#",
    "'",
    '"',
    "---\n",
)
CHARACTERS = ("\x85", "\u2028", "\x00", "é", "\U0001f916", "\ufeff", "\x7f")


def damaged(rng: Rng, content: bytes) -> bytes:
    """Return the content with one accident."""
    start = int(rng.integers(len(content))) if content else 0
    length = int(10 ** rng.uniform(0, 4))
    before, hit, after = content[:start], content[start : start + length], content[start + length :]
    match rng.integers(6):
        case 0:
            return before + bytes([(hit or b"\0")[0] ^ 1 << int(rng.integers(8))]) + hit[1:] + after
        case 1:
            return before + rng.bytes(len(hit)) + after
        case 2:
            return before + after
        case 3:
            return before + hit + hit + after
        case 4:
            return before + struct.pack("<Q", pick(rng, LENGTHS)) + content[start + 8 :]
        case _:
            return before


def damaged_text(rng: Rng, text: bytes) -> bytes:
    """Return a YAML text with one accident."""
    start = int(rng.integers(len(text) + 1))
    length = int(rng.integers(0, 30))
    before, hit, after = text[:start], text[start : start + length], text[start + length :]
    lines = text.split(b"\n")
    line = int(rng.integers(len(lines)))
    match rng.integers(12):
        case 0:
            return before + rng.bytes(int(rng.integers(1, 5))) + after
        case 1:
            return before + hit[::-1] + after
        case 2:
            return before + hit * int(10 ** rng.uniform(0, 3)) + after
        case 3:
            return before
        case 4:
            return before + pick(rng, TOKENS).encode() + hit + after
        case 5:  # indentation
            lines[line] = b" " * int(rng.integers(1, 5)) + lines[line] if rng.random() < 0.5 else lines[line].lstrip()
        case 6:
            lines[line] = lines[line].replace(b"  ", b"\t")
        case 7:
            lines.insert(line, lines[int(rng.integers(len(lines)))])
        case 8:
            del lines[line]
        case 9:
            bomb = _alias_bomb(rng)
            lines = [*lines, *bomb] if rng.random() < 0.5 else [*bomb, *lines]
        case 10:
            return _as_another_text(rng, text)
        case _:
            return before + hit + pick(rng, CHARACTERS).encode() + after
    return b"\n".join(lines)


def _alias_bomb(rng: Rng) -> list[bytes]:
    """Return lines of which each stands for ten of the one before."""
    levels = range(int(rng.integers(2, 12)))
    return [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10) if k else 1}]".encode() for k in levels]


def _as_another_text(rng: Rng, text: bytes) -> bytes:
    """Return the text in another encoding, twice, or with a very long comment."""
    match rng.integers(6):
        case 0:
            return b"\xef\xbb\xbf" + text
        case 1:
            return text.replace(b"\n", b"\r\n")
        case 2:
            return text.decode(errors="replace").encode("utf-16")
        case 3:
            return b"%YAML 1.1\n---\n" + text
        case 4:
            return text + b"\n---\n" + text
        case _:
            return text + b"#" * 300_000
