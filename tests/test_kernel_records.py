"""No kernel reads a record of an array that may be freed by then.

Numba frees an array after the last use of its name. A slice of it keeps it alive, a record of it does not: what is read
through the record later is what another array wrote there, or nothing that the process may read at all.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

import numba
import numpy as np
import pytest

from pbrg_mj.kernel import kernel
from pbrg_mj.kernel.decorator import Kernel
from tests.test_kernel import kernels

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are not compiled")

RECORD = np.dtype([("x", np.float64)])


def freed_records(function: Callable[..., Any]) -> list[str]:
    """Return the names of arrays of records, made in the function and not returned by it, whose records it takes."""
    body = ast.parse(textwrap.dedent(inspect.getsource(function)))
    made = set(_made(function, body))
    returned = _returned(body)
    taken = {
        one.value.id for one in ast.walk(body) if isinstance(one, ast.Subscript) and isinstance(one.value, ast.Name)
    }
    taken |= {one.iter.id for one in ast.walk(body) if isinstance(one, ast.For) and isinstance(one.iter, ast.Name)}
    return sorted((made - returned) & taken)


def _made(function: Callable[..., Any], body: ast.AST) -> Iterator[str]:
    """Yield the names that the function gives to new arrays of records."""
    for one in ast.walk(body):
        if isinstance(one, ast.Assign) and any(_makes_records(function, call) for call in ast.walk(one.value)):
            yield from (name.id for target in one.targets for name in _names(target))


def _makes_records(function: Callable[..., Any], call: ast.AST) -> bool:
    """Return whether a call makes an array of records, by itself or in a kernel that returns one."""
    if not isinstance(call, ast.Call):
        return False
    arguments = [*call.args, *(keyword.value for keyword in call.keywords)]
    values = [function.__globals__.get(one.id) for one in arguments if isinstance(one, ast.Name)]
    if any(isinstance(value, np.dtype) and value.names for value in values):
        return True
    called = function.__globals__.get(call.func.id) if isinstance(call.func, ast.Name) else None
    return isinstance(called, Kernel) and _returns_records(called.py_func)


def _returns_records(function: Callable[..., Any]) -> bool:
    body = ast.parse(textwrap.dedent(inspect.getsource(function)))
    returns = [one.value for one in ast.walk(body) if isinstance(one, ast.Return) and one.value]
    made_there = any(_makes_records(function, call) for value in returns for call in ast.walk(value))
    return made_there or not _returned(body).isdisjoint(_made(function, body))


def _returned(body: ast.AST) -> set[str]:
    """Return the names whose whole values a function returns: they live until its end."""
    values = [one.value for one in ast.walk(body) if isinstance(one, ast.Return)]
    parts = [part for value in values for part in (value.elts if isinstance(value, ast.Tuple) else [value])]
    return {part.id for part in parts if isinstance(part, ast.Name)}


def _names(node: ast.AST | None) -> list[ast.Name]:
    return [one for one in ast.walk(node) if isinstance(one, ast.Name)] if node else []


def test_no_kernel_takes_records_of_an_array_that_may_be_freed() -> None:
    found = {f"{one.__module__}.{one.__name__}": freed_records(one.py_func) for one in kernels()}
    assert {name: arrays for name, arrays in found.items() if arrays} == {}
    assert sum(_returns_records(one.py_func) for one in kernels()) >= 1  # there is something to look after


@kernel
def corners(n):
    made = np.zeros(n, RECORD)
    made[0]["x"] = 1.0
    return made


@kernel
def first_corner(n):
    found = corners(n)
    corner = found[0]
    return corner["x"]


@kernel
def own_corner(n):
    found = np.zeros(n, dtype=RECORD)
    return found[0]["x"]


@kernel
def numbers(n):
    return np.zeros(n)[0]


def test_what_the_search_finds() -> None:
    assert freed_records(first_corner.py_func) == ["found"]
    assert freed_records(own_corner.py_func) == ["found"]
    assert freed_records(corners.py_func) == freed_records(numbers.py_func) == []
