"""Compiled kernels: `@kernel` on a function of numbers and arrays, compiled when it is first called.

    decorator        `kernel`: what Python calls, and what other kernels link
    compiler         how they are compiled: with the numba this is written for as below, else as numba does by default
    pipeline         numba's passes as kernels need them
    numba_functions  numba's own functions in kernels: np.empty, min, operators
    quiet            numba without events, colours and warnings while it compiles
    lowering         arguments and parts of them, without counting references
    elements         elements of arrays
    libraries        one library of machine code for all that a call from Python leads to
    fingerprint      what compiled code depends on: the function, and the kernels and constants it uses
    cache            compiled kernels on disk, by their fingerprints
    stopwatch        a clock that stands still while kernels are compiled, and who is notified

Nothing checks an index (docs/reliability.md, Memory). Constants such as a[-1] count from the end, variables do not.

Without compiling (NUMBA_DISABLE_JIT=1) kernels are the plain functions.
"""

from pbrg_mj.kernel.cache import cache_folder
from pbrg_mj.kernel.decorator import kernel
from pbrg_mj.kernel.stopwatch import clock, watching_compilation

__all__ = ["cache_folder", "clock", "kernel", "watching_compilation"]
