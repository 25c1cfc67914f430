"""How numba compiles kernels here: a call from Python leads to ONE library of machine code.

By default numba gives every function that a kernel calls a library of its own: optimised, turned into machine code and
wrapped for calls from Python and from C, although it is only linked into its callers, which optimise it again. Here
only the kernels that Python calls are optimised and turned into code; those they call are linked as they were lowered.
The optimiser does not change what floating-point operations give, so neither does this.

This is written against numba's inside as of `TESTED`. With another numba, kernels are compiled as it does by default,
to the same results in three times the time.
"""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import sigutils, typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompilerBase, Flags, lookup_environment
from numba.core.compiler_machinery import PassManager
from numba.core.dispatcher import _FunctionCompiler
from numba.core.registry import CPUDispatcher

TESTED = (0, 68)
IS_TESTED = tuple(int(part) for part in numba.__version__.split(".")[:2]) == TESTED
ENVIRONMENT = "_ZN08NumbaEnv"  # prefix of the pointers to what functions need at run time

# Numba's own passes without those for closures, `with`, `literally` and fused array expressions.
PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.AnnotateTypes,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)


class _LinkedLibrary(JITCodeLibrary):
    """A function that is only linked into others: neither optimised nor turned into machine code."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return _NoPointers

    def libraries(self) -> list[Any]:
        """Return what this function calls, directly or not."""
        return _linked_into(self)


class _NoPointers:
    """There is no machine code yet whose pointers could be set."""

    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        """Do nothing: `_EntryLibrary` sets the pointer."""


class _EntryLibrary(JITCodeLibrary):
    """A kernel that Python calls, with all that it calls."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._linking_libraries = _linked_into(self)
        super().finalize()

    def _finalize_final_module(self) -> None:
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    self._codegen.set_env(variable.name, environment)


def _linked_into(library: Any) -> list[Any]:
    """Return all libraries that go into one, each once, callees after their callers."""
    found: dict[Any, None] = {}

    def add(one: Any) -> None:
        for called in one._linking_libraries:
            if called not in found:
                found[called] = None
                if isinstance(called, _LinkedLibrary):
                    add(called)

    add(library)
    return list(found)


class _Pipeline(CompilerBase):
    """Numba's passes, into a library of ours."""

    library_class: type[JITCodeLibrary]

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *rest: Any):
        super().__init__(typingctx, targetctx, library, *rest)
        if self.state.library is None:
            self.state.library = self.library_class(targetctx.codegen(), "kernel")
            self.state.library.enable_object_caching()

    def define_pipelines(self) -> list[PassManager]:
        passes = PassManager("nopython")
        for one in PASSES:
            passes.add_pass(one, one._name)
        passes.finalize()
        return [passes]


class _LinkedPipeline(_Pipeline):
    library_class = _LinkedLibrary


class _EntryPipeline(_Pipeline):
    library_class = _EntryLibrary


LinkedPipeline = _LinkedPipeline if IS_TESTED else Compiler
EntryPipeline = _EntryPipeline if IS_TESTED else Compiler


class LinkedDispatcher(CPUDispatcher):
    """A kernel as other kernels call it."""

    def __init__(self, function: Callable[..., Any]):
        options = {"nopython": True, "nogil": True, "no_cfunc_wrapper": True, "no_cpython_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=LinkedPipeline)
        self._compiler = lean_flags(self)

    def compile(self, signature: Any) -> Any:
        """Compile for the types of a call; numba's own also times it, at every level of a chain of calls again."""
        with self._compiling_counter:
            arguments, returned = sigutils.normalize_signature(signature)
            result = self.overloads.get(tuple(arguments))
            if result is None:
                result = self._compiler.compile(arguments, returned)
                self.add_overload(result)
            return result.entry_point


class _Flags(Flags):
    """Numba's flags, which it compares tens of thousands of times; without looking at all their defaults each time."""

    __slots__ = ("_hash",)

    def __hash__(self) -> int:
        try:
            return self._hash
        except AttributeError:
            self._hash = super().__hash__()
            return self._hash

    def __eq__(self, other: object) -> bool:
        return self._values == other._values if type(other) is _Flags else super().__eq__(other)


class _LeanCompiler(_FunctionCompiler):
    def _customize_flags(self, flags: Flags) -> Flags:
        return _Flags(flags)


def lean_flags(dispatcher: CPUDispatcher) -> _FunctionCompiler:
    """Return the dispatcher's compiler, with flags that are quick to compare."""
    numbas = dispatcher._compiler
    return _LeanCompiler(
        dispatcher.py_func, dispatcher.targetdescr, dispatcher.targetoptions, {}, numbas.pipeline_class
    )
