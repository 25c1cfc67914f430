"""Compiled kernels, kept on disk between runs under their fingerprints."""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.dispatcher import Dispatcher

from pbrg_mj.kernel.fingerprint import fingerprint

# Numba's settings that change the code it makes; its own cache knows of none of them.
SETTINGS = ("BOUNDSCHECK", "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT")


def cache_folder() -> Path:
    """Return where kernels are kept: $NUMBA_CACHE_DIR, or pbrg-mj in $XDG_CACHE_HOME or ~/.cache. May be deleted."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    user = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")  # noqa: PTH111, PTH118
    return Path(chosen) if chosen else Path(user) / "pbrg-mj"


def enable_cache(dispatcher: Dispatcher) -> None:
    """Let a kernel be read from the cache and written to it, if there is a place to write to."""
    try:
        dispatcher._cache = _KernelCache(dispatcher.py_func)
    except RuntimeError:  # numba's: no folder it may write to
        return


@cache
def _compiler_state() -> str:
    """Return what compiled code depends on besides the kernels: numba, and how this package has it compile."""
    settings = [f"{name}={getattr(numba.config, name, None)}" for name in SETTINGS]
    state = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__} {settings}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        state.update(path.read_bytes())
    return state.hexdigest()


class _Locator(_CacheLocator):
    """Where a kernel is kept: one folder, a name that holds its fingerprint."""

    def __init__(self, function: Callable[..., Any]):
        self._state = hashlib.sha256(f"{_compiler_state()} {fingerprint(function)}".encode()).hexdigest()

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return self._state

    def get_disambiguator(self) -> str:
        return self._state[:16]

    @classmethod
    def from_function(cls, function: Callable[..., Any], _file: str) -> _Locator | None:
        locator = cls(function)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


class _KernelCacheImplementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012 - numba's


class _KernelCache(FunctionCache):
    _impl_class = _KernelCacheImplementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code for a signature, None where the cache has none, or none that this version reads.

        The index names the types of arguments, which may since have moved to another module.
        """
        try:
            return super().load_overload(sig, target_context)
        except (AttributeError, ImportError):
            self.flush()
            return None
