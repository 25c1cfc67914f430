"""What a kernel's compiled code depends on, as one number.

Numba notices when the file of a cached function changes, but not when a function that it calls does, in another file:
old code would go on giving old answers. And most changes of a file change no kernel in it. So a kernel is known by its
own code, its constants and, in turn, the kernels it uses.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterator
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

PLAIN = (bool, int, float, complex, str, bytes, type(None))


def fingerprint(function: Callable[..., Any]) -> str:
    """Return a hexadecimal number that changes with anything that `function` would be compiled from."""
    state, seen = hashlib.sha256(), set()
    for part in _of_function(function, seen):
        state.update(part.encode() + b"\0")
    return state.hexdigest()


def _of_function(function: Callable[..., Any], seen: set[int]) -> Iterator[str]:
    if id(function) in seen:
        return
    seen.add(id(function))
    yield f"{function.__module__}.{function.__qualname__}{function.__defaults__}{function.__kwdefaults__}"
    yield from _of_code(function.__code__)
    used = inspect.getclosurevars(function)
    for name, value in sorted({**used.globals, **used.nonlocals}.items()):
        yield name
        yield from _of_value(value, seen)


def _of_code(code: CodeType) -> Iterator[str]:
    """Describe bytecode without the lines it stands in."""
    yield f"{code.co_code.hex()}{code.co_names}{code.co_varnames}{code.co_freevars}{code.co_exceptiontable.hex()}"
    for constant in code.co_consts[1 if code.co_consts[:1] == (None,) else 0 :]:
        if isinstance(constant, CodeType):
            yield from _of_code(constant)
        else:
            yield repr(constant)


def _of_value(value: Any, seen: set[int]) -> Iterator[str]:
    """Describe what a kernel finds under a global name. Raises TypeError for what no kernel can use."""
    function = getattr(value, "py_func", value)
    if isinstance(function, FunctionType):
        yield from _of_function(function, seen)
    elif isinstance(value, PLAIN):
        yield f"{type(value).__name__} {value!r}"
    elif isinstance(value, tuple | list | frozenset):
        yield type(value).__name__
        for part in value:
            yield from _of_value(part, seen)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype.descr} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, np.dtype):
        yield str(value.descr)
    elif isinstance(value, type):  # of named tuples the fields count, of numpy's numbers the name
        yield f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
    elif isinstance(value, BuiltinFunctionType | ModuleType | np.ufunc):
        yield repr(value)
    else:
        raise TypeError(f"a kernel uses {value!r}, which its fingerprint does not know")
