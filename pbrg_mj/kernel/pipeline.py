"""Numba's passes as kernels need them, into libraries of ours, and the dispatchers that run them."""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false
# pyright: reportIncompatibleVariableOverride=false

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

from numba.core import sigutils, typed_passes, types, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompilerBase, Flags
from numba.core.compiler_machinery import PassManager
from numba.core.cpu import CPUContext
from numba.core.dispatcher import _FunctionCompiler
from numba.core.errors import ForceLiteralArg
from numba.core.postproc import PostProcessor
from numba.core.registry import CPUDispatcher
from numba.core.transforms import canonicalize_cfg
from numba.core.typing import Context

from pbrg_mj.kernel.libraries import EntryLibrary, LinkedLibrary
from pbrg_mj.kernel.lowering import BorrowingLowering
from pbrg_mj.kernel.numba_functions import lean_numba
from pbrg_mj.kernel.quiet import quiet_numba

# Numba's own passes without those for closures, `with`, `literally` and fused array expressions.
PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.AnnotateTypes,
    BorrowingLowering,
    typed_passes.NoPythonBackend,
)


# Those after which numba finds out how long variables live, which only lowering asks for. A pass before it does, too.
LIFETIMES = untyped_passes.GenericRewrites, untyped_passes.ReconstructSSA, typed_passes.PreLowerStripPhis


class _Pipeline(CompilerBase):
    """Numba's passes, into a library of ours."""

    library_class: type[JITCodeLibrary]

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *rest: Any):
        with _as_known() if self.library_class is LinkedLibrary else nullcontext():
            super().__init__(typingctx, targetctx, library, *rest)
        if self.state.library is None:
            self.state.library = self.library_class(targetctx.codegen(), "kernel")
            self.state.library.enable_object_caching()

    def define_pipelines(self) -> list[PassManager]:
        passes = _Passes("nopython")
        for one in PASSES:
            passes.add_pass(one, one._name)
        passes.finalize()
        return [passes]


@contextmanager
def _as_known() -> Iterator[None]:
    """Have numba not look again for functions registered since: it did for what Python calls, and does for its own."""
    refresh = CPUContext.refresh, Context.refresh
    CPUContext.refresh = Context.refresh = lambda _: None
    try:
        yield
    finally:
        CPUContext.refresh, Context.refresh = refresh


class _Passes(PassManager):
    """Passes after each of which numba does not tidy up: these need that only where they do it themselves."""

    _ENFORCING = False

    def _runPass(self, index: int, one: Any, state: Any) -> None:
        """Run a pass; numba's own also writes out all types, for listeners to events."""
        one.analysis = self._analysis
        with _without_lifetimes() if isinstance(one, LIFETIMES) else nullcontext():
            one.run_pass(state)


@contextmanager
def _without_lifetimes() -> Iterator[None]:
    """Have numba tidy up blocks and nothing else."""
    run = PostProcessor.run
    PostProcessor.run = _tidy_blocks
    try:
        yield
    finally:
        PostProcessor.run = run


def _tidy_blocks(processor: PostProcessor, **_: Any) -> None:
    function = processor.func_ir
    function.blocks, function.generator_info = canonicalize_cfg(function.blocks), None


class LinkedPipeline(_Pipeline):
    """For a kernel as other kernels call it."""

    library_class = LinkedLibrary


class EntryPipeline(_Pipeline):
    """For a kernel as Python calls it."""

    library_class = EntryLibrary


class _NumbaPipeline(Compiler):
    """Numba's passes for a function of its own."""

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *rest: Any):
        super().__init__(typingctx, targetctx, library, *rest)
        if self.state.library is None:
            self.state.library = LinkedLibrary(targetctx.codegen(), "numba function")
            self.state.library.enable_object_caching()


class LinkedDispatcher(CPUDispatcher):
    """A kernel as other kernels call it."""

    def __init__(self, function: Callable[..., Any]):
        options = {"nopython": True, "nogil": True, "no_cfunc_wrapper": True, "no_cpython_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=LinkedPipeline)
        self._compiler = lean_flags(self)

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, Any, Any, Any]:
        """Compile for the types of a call; numba's own compiles again for every constant that is an argument."""
        python_signature, folded = self._compiler.fold_argument_types(args, kws)
        kinds = tuple(map(types.unliteral, folded))
        self.compile(kinds)
        return _Compiled(self.overloads[kinds].signature), python_signature, kinds, {}

    def compile(self, signature: Any) -> Any:
        """Compile for the types of a call; numba's own also times it, at every level of a chain of calls again."""
        with self._compiling_counter:
            arguments, returned = sigutils.normalize_signature(signature)
            result = self.overloads.get(tuple(arguments))
            if result is None:
                result = self._compiler.compile(arguments, returned)
                self.add_overload(result)
            return result.entry_point


class _Compiled:
    """What numba asks for the signature of a call: of a kernel that has been compiled for its types."""

    def __init__(self, signature: Any):
        self._signature = signature

    def __call__(self, _: Any) -> _Compiled:
        return self

    def apply(self, *_: Any) -> Any:
        """Return the signature, whatever the types: it was compiled for them."""
        return self._signature


class _NumbaFunctionDispatcher(LinkedDispatcher):
    """A function of numba's own as kernels call it. Some ask for constants."""

    get_call_template = CPUDispatcher.get_call_template

    def __init__(self, py_func: Callable[..., Any], locals: Any = None, targetoptions: Any = None, **_: Any):  # noqa: A002 - numba's
        CPUDispatcher.__init__(self, py_func, locals, targetoptions, pipeline_class=_NumbaPipeline)
        self._compiler = lean_flags(self)

    def compile(self, signature: Any) -> Any:
        """Compile for the types of a call; where it asks for a literal, say of which argument."""
        try:
            return super().compile(signature)
        except ForceLiteralArg as asked:
            raise asked.bind_fold_arguments(lambda *call: self._compiler.fold_argument_types(*call)[1]) from None


@contextmanager
def lean_compilation() -> Iterator[None]:
    """Compile kernels leanly while the context lasts."""
    with quiet_numba(), lean_numba(_NumbaFunctionDispatcher):
        yield


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
        return type(other) is _Flags and self._values == other._values  # else numba would link to what is no code


class _LeanCompiler(_FunctionCompiler):
    def _customize_flags(self, flags: Flags) -> Flags:
        return _Flags(flags)


def lean_flags(dispatcher: CPUDispatcher) -> _FunctionCompiler:
    """Return the dispatcher's compiler, with flags that are quick to compare."""
    numbas = dispatcher._compiler
    return _LeanCompiler(
        dispatcher.py_func, dispatcher.targetdescr, dispatcher.targetoptions, {}, numbas.pipeline_class
    )
