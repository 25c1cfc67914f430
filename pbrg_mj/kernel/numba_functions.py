"""Numba's own functions (np.empty, min, operators) where kernels use them, with what numba does again and again.

While a kernel is compiled, numba's functions are linked into it as other kernels are; which implementation a call leads
to is found once for the same types; and references are counted without a look at what cannot hold any.
"""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from types import BuiltinFunctionType
from typing import Any

from numba.core import ir, types
from numba.core.cpu import CPUContext
from numba.core.datamodel import ArgPacker
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.runtime.context import NRTContext
from numba.core.target_extension import CPU, dispatcher_registry

_signatures: dict[Any, Any] = {}
_WITHOUT_VARIABLES = frozenset({str, int, float, bool, type(None), ir.Loc})


@contextmanager
def lean_numba(dispatcher: type[CPUDispatcher]) -> Iterator[None]:
    """Have numba compile its own functions with `dispatcher`, and leanly, while the context lasts."""
    typing, numbas = cpu_target.typing_context, dispatcher_registry[CPU]
    meminfos, packer, variables = NRTContext.get_meminfos, CPUContext.get_arg_packer, ir.Inst._rec_list_vars
    dict.__setitem__(dispatcher_registry, CPU, dispatcher)  # numba's own refuses to set a key again
    NRTContext.get_meminfos, CPUContext.get_arg_packer, ir.Inst._rec_list_vars = _references, _packer, _variables
    typing.resolve_function_type = _remembering(typing.resolve_function_type)
    typing.resolve_value_type = _remembering_operators(typing.resolve_value_type)
    try:
        yield
    finally:
        dict.__setitem__(dispatcher_registry, CPU, numbas)
        NRTContext.get_meminfos, CPUContext.get_arg_packer, ir.Inst._rec_list_vars = meminfos, packer, variables
        del typing.resolve_function_type, typing.resolve_value_type


def _remembering(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's search for the signature of a call, which searches once for the same types."""

    def found(function: Any, arguments: tuple, keywords: Any) -> Any:
        if isinstance(function, types.Type) and not isinstance(function, types.Function):
            return resolve(function, arguments, keywords)  # kernels, and what else knows its signatures itself
        key = function, tuple(map(_known_by, arguments)), tuple(dict(keywords).items())
        if None in key[1]:
            return resolve(function, arguments, keywords)
        signature = _signatures.get(key)
        if signature is None:
            signature = resolve(function, arguments, keywords)
            if signature is not None:
                _signatures[key] = signature
        return signature

    return found


def _remembering_operators(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's search for the type of a constant, which searches once for functions such as `operator.add`."""
    known: dict[Any, Any] = {}

    def found(value: Any) -> Any:
        if type(value) is not BuiltinFunctionType:
            return resolve(value)
        if value not in known:
            known[value] = resolve(value)
        return known[value]

    return found


def _known_by(argument: Any) -> Any:
    """Return what an argument is remembered by: its type, or a constant that is an index; None if it is not."""
    if isinstance(argument, types.Type):
        return argument if argument.is_precise() else None
    return (type(argument), argument) if isinstance(argument, int | str) else None


def _variables(instruction: ir.Inst, value: Any) -> list[ir.Var]:
    """Return what `Inst._rec_list_vars` returns: the variables in a part of an instruction."""
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind is dict:
        parts = value.values()
    elif kind is tuple or kind is list:
        parts = value
    else:
        return value.list_vars() if isinstance(value, ir.Inst) else []
    return [one for part in parts if type(part) not in _WITHOUT_VARIABLES for one in _variables(instruction, part)]


def _references(nrt: NRTContext, builder: Any, kind: types.Type, value: Any) -> list[tuple[types.Type, Any]]:
    """Return what `NRTContext.get_meminfos` returns: the references in a value, with the types that hold them."""
    model = _model(kind)
    found = [(kind, model.get_nrt_meminfo(builder, value))] if model.has_nrt_meminfo() else []
    for member, part in model.traverse(builder):
        if _holds_references(member):
            found += _references(nrt, builder, member, part(value))
    return found


@cache
def _holds_references(kind: types.Type) -> bool:
    return _model(kind).contains_nrt_meminfo()


def _model(kind: types.Type) -> Any:
    return cpu_target.target_context.data_model_manager[kind]


class _Packer(ArgPacker):
    """Numba's way of passing arguments; those that go on as they came are not taken apart again."""

    def as_arguments(self, builder: Any, values: Any) -> tuple:
        """Return numbers and pointers instead of arrays and tuples."""
        models = zip(self._dm_args, values, strict=True)
        taken = [getattr(value, "leaves", None) or model.as_argument(builder, value) for model, value in models]
        return tuple(_flat(taken))


@cache
def _packer_of(kinds: tuple[types.Type, ...]) -> ArgPacker:
    return _Packer(cpu_target.target_context.data_model_manager, kinds)


def _packer(_: CPUContext, kinds: Iterable[types.Type]) -> ArgPacker:
    return _packer_of(tuple(kinds))


def _flat(nested: Any) -> Iterator[Any]:
    for one in nested:
        if isinstance(one, tuple | list):
            yield from _flat(one)
        else:
            yield one
