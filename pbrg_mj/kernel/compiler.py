"""How numba compiles kernels here: a call from Python leads to ONE library of machine code.

By default numba gives every function that a kernel calls a library of its own: optimised, turned into machine code and
wrapped for calls from Python and from C, although it is only linked into its callers, which optimise it again. Here
only the kernels that Python calls are optimised and turned into code; those they call are linked as they were lowered,
and lowered without what the optimiser would take out again. The optimiser does not change what floating-point
operations give, so neither does this.

This is written against numba's inside as of `TESTED`. With another numba, kernels are compiled as it does by default,
to the same results in four times the time.
"""

# Numba's classes are put together at run time, unknown to type checkers.
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core.registry import CPUDispatcher

TESTED = (0, 68)
IS_TESTED = tuple(int(part) for part in numba.__version__.split(".")[:2]) == TESTED

if IS_TESTED:
    from pbrg_mj.kernel.pipeline import EntryPipeline, LinkedDispatcher, lean_compilation, lean_flags
else:
    from contextlib import nullcontext as lean_compilation

    from numba.core.compiler import Compiler as EntryPipeline

    def lean_flags(dispatcher: CPUDispatcher) -> Any:
        """Return the dispatcher's compiler, numba's own."""
        return dispatcher._compiler

    def LinkedDispatcher(function: Callable[..., Any]) -> CPUDispatcher:
        """Return a kernel as other kernels call it."""
        return CPUDispatcher(function, targetoptions={"nopython": True, "nogil": True})


__all__ = ["IS_TESTED", "EntryPipeline", "LinkedDispatcher", "lean_compilation", "lean_flags"]
