"""Linear algebra on one thread.

OpenBLAS and its like share large matrices out over the cores, and each share is rounded apart: a run of a hundred
robots would depend on the machine's cores, bit for bit. Matrices here are small; on a busy machine threads that wait
for each other cost more than they save.
"""

from __future__ import annotations

import os
import sys

VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def limit_blas_threads() -> None:
    """Let every BLAS of this process and its children work on one thread: those that come, and those that are there."""
    os.environ.update(dict.fromkeys(VARIABLES, "1"))
    if "numpy" in sys.modules:
        from threadpoolctl import threadpool_limits

        threadpool_limits(1, user_api="blas")
