"""Numba without what it does thousands of times and nobody asks for: events, colours, warnings.

What is compiled is the same. An error names file and line, without the lines around it.
"""

# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any

from llvmlite.binding import ffi
from numba.core import base, errors, ir


@contextmanager
def quiet_numba() -> Iterator[None]:
    """Keep numba from all this while the context lasts."""
    with ExitStack() as stack:
        for owner, name, value in (
            (ffi.lib._lock, "_cblist", []),  # two events for every call of LLVM
            (type(errors.termcolor()), "_markup", _uncoloured),  # of errors that numba raises and catches itself
            (ir.Loc, "strformat", _file_and_line),  # likewise
            (errors.WarningsFixer, "catch_warnings", _as_they_come),
            (base, "_has_loc", cache(base._has_loc)),
        ):
            stack.callback(setattr, owner, name, getattr(owner, name, None))
            setattr(owner, name, value)
        yield


def _uncoloured(_: Any, message: str, *__: Any) -> str:
    return message


def _file_and_line(place: ir.Loc) -> str:
    return f'File "{place.filename}", line {place.line}'


@contextmanager
def _as_they_come(_: Any, **__: Any) -> Iterator[None]:
    yield
