"""Rows of a Markdown table."""

from __future__ import annotations

from collections.abc import Iterable


def table_rows(rows: Iterable[tuple[str, ...]]) -> str:
    """Return them, a line each."""
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)
