"""Compiled kernels, kept on disk between runs.

Numba notices when a cached function's own file changes, but not when a function that it calls does, in another file: an
old kernel would go on giving old answers. So the cache lies in a folder named after the state of ALL our kernels.
"""

# Numba's settings are attributes made at import, unknown to type checkers.
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

_PACKAGE = Path(__file__).resolve().parent


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function when it is first called, or take it from the cache; without a place to cache, just compile."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        return numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba's: no folder it may write to
        return numba.njit(nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = before


@cache
def cache_folder() -> Path:
    """Return where these very kernels are kept: below $NUMBA_CACHE_DIR, $XDG_CACHE_HOME or ~/.cache. May be deleted."""
    state = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if b"@kernel" in source:
            state.update(str(path.relative_to(_PACKAGE)).encode() + source)
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    user = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")  # noqa: PTH111, PTH118
    return (Path(chosen) if chosen else Path(user) / "pbrg-mj") / state.hexdigest()[:16]
