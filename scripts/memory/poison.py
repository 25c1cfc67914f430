"""NumPy's array memory filled with nonsense: when it is fresh, and again when it is freed.

MALLOC_PERTURB_ and PYTHONMALLOC=malloc_debug do the same for what is allocated through C and Python, compiled kernels'
arrays among it. They miss NumPy's small arrays, which it keeps in a cache of its own.
"""

from __future__ import annotations

import ctypes

import numba
import numpy as np
from numpy._core import _multiarray_umath

FRESH, FREED = 0xFF, 0xDB  # NaN and -1; -1.4e131
SET_HANDLER = 304  # PyDataMem_SetHandler in NumPy's table of C functions
NAME = b"mem_handler"  # of the capsule, which keeps no copy of it

_libc = ctypes.CDLL(None)
_malloc, _calloc, _realloc, _free, _memset = (_libc[name] for name in ("malloc", "calloc", "realloc", "free", "memset"))
_malloc.argtypes, _malloc.restype = (ctypes.c_size_t,), ctypes.c_size_t
_calloc.argtypes, _calloc.restype = (ctypes.c_size_t, ctypes.c_size_t), ctypes.c_size_t
_realloc.argtypes, _realloc.restype = (ctypes.c_size_t, ctypes.c_size_t), ctypes.c_size_t
_free.argtypes, _free.restype = (ctypes.c_size_t,), None
_memset.argtypes, _memset.restype = (ctypes.c_size_t, ctypes.c_int, ctypes.c_size_t), ctypes.c_size_t


@numba.cfunc("uintp(uintp, uintp)")
def _fresh(_, size):
    at = _malloc(size)
    if at:
        _memset(at, FRESH, size)
    return at


@numba.cfunc("uintp(uintp, uintp, uintp)")
def _zeros(_, count, size):
    return _calloc(count, size)


@numba.cfunc("uintp(uintp, uintp, uintp)")
def _resized(_, at, size):
    return _realloc(at, size)


@numba.cfunc("void(uintp, uintp, uintp)")
def _freed(_, at, size):
    if at:
        _memset(at, FREED, size)
        _free(at)


class _Handler(ctypes.Structure):
    """`PyDataMem_Handler` of NumPy's ndarraytypes.h."""

    _fields_ = (
        ("name", ctypes.c_char * 127),
        ("version", ctypes.c_uint8),
        ("context", ctypes.c_void_p),
        ("malloc", ctypes.c_void_p),
        ("calloc", ctypes.c_void_p),
        ("realloc", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
    )


_handler = _Handler(b"poison", 1, None, _fresh.address, _zeros.address, _resized.address, _freed.address)


def poison_arrays() -> None:
    """Fill the memory of all arrays that this thread makes from now on; others end as they began."""
    api = ctypes.pythonapi
    new, pointer = api.PyCapsule_New, api.PyCapsule_GetPointer
    new.argtypes, new.restype = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p), ctypes.py_object
    pointer.argtypes, pointer.restype = (ctypes.py_object, ctypes.c_char_p), ctypes.c_void_p
    table = ctypes.cast(pointer(_multiarray_umath._ARRAY_API, None), ctypes.POINTER(ctypes.c_void_p))
    set_handler = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.py_object)(table[SET_HANDLER])
    set_handler(new(ctypes.addressof(_handler), NAME, None))
    for kept in (NAME, _handler, _fresh, _zeros, _resized, _freed):  # the last arrays are freed after all modules
        api.Py_IncRef(ctypes.py_object(kept))
    if not np.isnan(np.empty(3)).all():
        raise RuntimeError("NumPy's memory is not poisoned")
