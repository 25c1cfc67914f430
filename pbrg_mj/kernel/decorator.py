"""The decorator of compiled functions."""

# Numba's settings are attributes made at import, unknown to type checkers.
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false, reportIncompatibleMethodOverride=false

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

import numba
from numba.core import event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher

from pbrg_mj.kernel.cache import enable_cache
from pbrg_mj.kernel.compiler import EntryPipeline, LinkedDispatcher, lean_compilation, lean_flags
from pbrg_mj.kernel.stopwatch import not_counted, report


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function when it is first called, or take it from the cache; without a place to cache, just compile."""
    return function if numba.config.DISABLE_JIT else Kernel(function)


class Kernel(CPUDispatcher):
    """A kernel as Python calls it. Kernels that call it link its twin, which has no entry from Python of its own."""

    def __init__(self, function: Callable[..., Any]):
        options = {"nopython": True, "nogil": True, "no_cfunc_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=EntryPipeline)
        self._compiler = lean_flags(self)
        self._twin = LinkedDispatcher(function)
        self._looked_for_cache = False

    @property
    def _numba_type_(self) -> types.Dispatcher:
        return types.Dispatcher(self._twin)

    def compile(self, signature: Any) -> Any:
        """Compile for the types of a call, or read that from the cache."""
        with global_compiler_lock, not_counted(), _without_collecting(), lean_compilation():
            if not self._looked_for_cache:  # only now is all there that the function refers to
                self._looked_for_cache = True
                enable_cache(self)
            return super().compile(signature)


class _without_collecting:
    """Python's search for garbage finds little while kernels are compiled and takes a tenth of the time."""

    def __enter__(self) -> None:
        self._was_enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self._was_enabled:
            gc.enable()


class _Reporter(event.Listener):
    """Hears from numba what is compiled; the cache says nothing."""

    def on_start(self, event: Any) -> None:
        function = event.data["dispatcher"]
        if isinstance(function, Kernel):
            report(f"{function.__module__.removeprefix('pbrg_mj.')}.{function.__name__}")

    def on_end(self, event: Any) -> None:
        if isinstance(event.data["dispatcher"], Kernel):
            report(None)


event.register("numba:compile", _Reporter())
