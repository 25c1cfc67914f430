"""Lowering to LLVM without counting references that a kernel only borrows.

Numba counts a reference to each array of a tuple whenever a variable takes the tuple, a part of it or an argument, and
counts it back when the variable goes. Most kernels take tuples of many arrays: two thirds of what they were lowered to
was counting and copying of tuples, for LLVM to take out again. But the caller holds its references as long as a call
lasts. So a variable borrows if it is assigned in one place only, and that is an argument, another variable that
borrows, or a member of a tuple that borrows. Such a variable needs no memory either: it is a part of an argument.
"""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false
# pyright: reportArgumentType=false

from __future__ import annotations

from collections import Counter
from typing import Any

from llvmlite.ir import Constant, Undefined
from numba.core import ir, types
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import BaseNativeLowering

from pbrg_mj.kernel.elements import ElementLower, Values

PARTS = ("getattr", "static_getitem", "exhaust_iter")
Path = tuple[int, ...]  # an argument, a member of it, a member of that, ...


class _BorrowingLower(ElementLower):
    """Numba's lowering of a function, but for what it borrows."""

    def extract_function_arguments(self) -> None:
        """Keep the numbers and pointers that arguments come as; arguments are put together when asked for."""
        packer = self.call_conv._get_arg_packer(self.fndesc.argtypes)
        self._leaves = packer._unflattener.unflatten(self.call_conv.get_arguments(self.function))
        self._made: dict[Path, Any] = {
            (index,): self.context.data_model_manager[kind].from_argument(self.builder, leaves)
            for index, (kind, leaves) in enumerate(zip(self.fndesc.argtypes, self._leaves, strict=True))
            if not _is_plain(kind)
        }

    def lower_function_body(self) -> Any:
        """Find what borrows before anything is lowered."""
        assignments = [one for block in self.blocks.values() for one in block.find_insts(ir.Assign)]
        often = Counter(one.target.name for one in assignments)
        once = [one for one in assignments if often[one.target.name] == 1]
        self._borrowed: dict[str, Path] = {}
        before = -1
        while len(self._borrowed) > before:  # blocks need not come in the order they are run in
            before = len(self._borrowed)
            for one in once:
                path = self._path(one)
                if path is not None:
                    self._borrowed[one.target.name] = path
        return super().lower_function_body()

    def _path(self, assignment: Any) -> Path | None:
        """Return where what is assigned is found in the arguments, None if it is not borrowed."""
        value, held = assignment.value, self.typeof(assignment.target.name)
        if isinstance(value, ir.Arg):
            return (value.index,) if held == self.typeof("arg." + value.name) and _is_plain(held) else None
        if isinstance(value, ir.Var):
            source = value
        elif isinstance(value, ir.Expr) and value.op in PARTS:
            source = value.value
        else:
            return None
        path = self._borrowed.get(source.name)
        if path is None:
            return None
        whole = self.typeof(source.name)
        if isinstance(value, ir.Var) or (value.op == "exhaust_iter" and isinstance(whole, types.BaseTuple)):
            return path if held == whole else None
        index = _member(whole, value)
        return (*path, index) if index is not None and held == whole[index] else None

    def _make(self, path: Path) -> Any:
        """Return a part of an argument, put together where the function begins, or by what called this."""
        if path not in self._made:
            with self.builder.goto_entry_block():
                self._made[path] = self._put_together(path, *self._part(path))
            self._made[path].leaves = self._part(path)[1]  # which calls of other functions take
        return self._made[path]

    def _part(self, path: Path) -> tuple[types.Type, Any]:
        """Return the type of a part, and what it comes as."""
        kind, leaves = self.fndesc.argtypes[path[0]], self._leaves[path[0]]
        for index in path[1:]:
            kind, leaves = kind[index], leaves[index]
        return kind, leaves

    def _put_together(self, path: Path, kind: types.Type, leaves: Any) -> Any:
        model = self.context.data_model_manager[kind]
        if isinstance(kind, types.Boolean):  # without the branches that numba makes
            return self.builder.icmp_unsigned("!=", leaves, leaves.type(0))
        if not isinstance(kind, types.BaseTuple):
            return model.from_argument(self.builder, leaves)
        whole = Constant(model.get_value_type(), Undefined)
        for index in range(len(kind)):
            whole = self.builder.insert_value(whole, self._make((*path, index)), index)
        return whole

    @property
    def fnargs(self) -> Any:
        """The arguments, for variables that do not borrow."""
        return [self._make((index,)) for index in range(len(self.fndesc.argtypes))]

    def array_parts(self, name: str) -> tuple[Any, Values, Values]:
        """Return data pointer, shape and strides of an array, which a borrowed one comes as."""
        if name not in self._borrowed:
            return super().array_parts(name)
        model = self.context.data_model_manager[self.typeof(name)]
        leaves = self._part(self._borrowed[name])[1]
        data, shape, strides = (leaves[model.get_field_position(part)] for part in ("data", "shape", "strides"))
        return data, shape, strides

    def lower_inst(self, inst: Any) -> None:
        """Do nothing where a variable borrows."""
        if not (isinstance(inst, ir.Assign) and inst.target.name in self._borrowed):
            super().lower_inst(inst)

    def loadvar(self, name: str) -> Any:
        """Return what a variable holds."""
        return self._make(self._borrowed[name]) if name in self._borrowed else super().loadvar(name)

    def _alloca_var(self, name: str, fetype: Any) -> None:
        if name not in self._borrowed:
            super()._alloca_var(name, fetype)

    def delvar(self, name: str) -> None:
        """Give back nothing that was borrowed."""
        if name not in self._borrowed:
            super().delvar(name)


def _is_plain(kind: types.Type) -> bool:
    """Return whether an argument can be put together of its parts anywhere: arrays, numbers and tuples of them."""
    if isinstance(kind, types.BaseTuple):
        return all(map(_is_plain, kind))
    return isinstance(kind, types.Array | types.Integer | types.Float | types.Boolean | types.Record)


def _member(whole: types.Type, expression: Any) -> int | None:
    """Return which member of a tuple an expression is, None if it is anything else."""
    if not isinstance(whole, types.BaseTuple):
        return None
    if expression.op == "getattr" and isinstance(whole, types.BaseNamedTuple):
        return whole.fields.index(expression.attr) if expression.attr in whole.fields else None
    if expression.op == "static_getitem" and isinstance(expression.index, int):
        return expression.index % len(whole)
    return None


@register_pass(mutates_CFG=True, analysis_only=False)
class BorrowingLowering(BaseNativeLowering):
    """The pass that does it."""

    _name = "borrowing_lowering"

    @property
    def lowering_class(self) -> type[Lower]:
        """How functions are lowered."""
        return _BorrowingLower
