"""Lowering of an array's elements: from data pointer, shape and strides straight to the address.

Numba puts every array into memory first, of which it then takes shape and strides, and every pair of indices into a
tuple. Half of what kernels were lowered to was that. What is computed is the same, but for variables as indices: they
count from an array's start, and a negative one is out of bounds as one too large is. For numba it counts from the end,
and the processor fetches elements one by one that it could load side by side.
"""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false
# pyright: reportArgumentType=false

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from numba.core import cgutils, ir, types
from numba.core.lowering import Lower
from numba.np.arrayobj import load_item, store_item

GETS = ("getitem", "static_getitem")
Values = Sequence[Any]  # of LLVM


class ElementLower(Lower):
    """Numba's lowering of a function, but for elements of arrays."""

    def lower_function_body(self) -> Any:
        """Find the tuples that are indices and nothing else."""
        self._indices: dict[str, tuple[Values, Sequence[types.Type]]] = {}
        self._index_only = _index_only([one for block in self.blocks.values() for one in block.body], self.typeof)
        return super().lower_function_body()

    def array_parts(self, name: str) -> tuple[Any, Values, Values]:
        """Return data pointer, shape and strides of an array."""
        kind, builder = self.typeof(name), self.builder
        model = self.context.data_model_manager[kind]
        places = [model.get_field_position(part) for part in ("data", "shape", "strides")]
        if name in self._blk_local_varmap:
            array = self._blk_local_varmap[name]
            data, shape, strides = (builder.extract_value(array, place) for place in places)
        else:
            where = self.getvar(name)
            data, shape, strides = (builder.load(cgutils.gep_inbounds(builder, where, 0, place)) for place in places)
        return data, cgutils.unpack_tuple(builder, shape), cgutils.unpack_tuple(builder, strides)

    def _element(self, array: ir.Var, index: ir.Var) -> Any:
        """Return the address of an element, None if it is not one element that is asked for."""
        kind = self.typeof(array.name)
        if not _is_element(kind, self.typeof(index.name)):
            return None
        data, shape, strides = self.array_parts(array.name)
        at = [self._from_start(*one) for one in zip(*self._index(index.name), shape, strict=True)]
        if self.context.enable_boundscheck:
            for axis, (place, size) in enumerate(zip(at, shape, strict=True)):
                cgutils.do_boundscheck(self.context, self.builder, place, size, axis)
        return cgutils.get_item_pointer2(self.context, self.builder, data, shape, strides, kind.layout, at)

    def _index(self, name: str) -> tuple[Values, Sequence[types.Type]]:
        """Return the numbers of an index, and their types."""
        if name in self._indices:
            return self._indices[name]
        kind, value = self.typeof(name), self.loadvar(name)
        if isinstance(kind, types.BaseTuple):
            return cgutils.unpack_tuple(self.builder, value, len(kind)), tuple(kind)
        return (value,), (kind,)

    def _from_start(self, value: Any, kind: types.Type, size: Any) -> Any:
        """Return an index counted from the start: a constant may be negative, a variable is taken not to be."""
        if not isinstance(kind, types.IntegerLiteral):
            return self.context.cast(self.builder, value, kind, types.intp)
        constant = self.context.get_constant(types.intp, kind.literal_value)
        return constant if kind.literal_value >= 0 else self.builder.add(size, constant)

    def lower_inst(self, inst: Any) -> None:
        """Keep an index as the numbers it consists of."""
        if isinstance(inst, ir.Assign) and inst.target.name in self._index_only:
            value = inst.value
            if isinstance(value, ir.Var):
                self._indices[inst.target.name] = self._indices[value.name]
            else:
                values = [self.loadvar(item.name) for item in value.items]
                self._indices[inst.target.name] = values, [self.typeof(item.name) for item in value.items]
        elif isinstance(inst, ir.StaticSetItem) and self._is_static(inst.target, inst.index_var):
            self.lower_setitem(inst.target, inst.index_var, inst.value, self.fndesc.calltypes[inst])
        else:
            super().lower_inst(inst)

    def lower_expr(self, resty: types.Type, expr: Any) -> Any:
        """Treat an index that is constant as any other."""
        if expr.op == "static_getitem" and self._is_static(expr.value, expr.index_var):
            return self.lower_getitem(resty, expr, expr.value, expr.index_var, self.fndesc.calltypes[expr])
        return super().lower_expr(resty, expr)

    def _is_static(self, array: ir.Var, index: ir.Var | None) -> bool:
        return index is not None and _is_element(self.typeof(array.name), self.typeof(index.name))

    def lower_getitem(self, resty: types.Type, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """Load an element."""
        where = self._element(value, index)
        if where is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        loaded = load_item(self.context, self.builder, self.typeof(value.name), where)
        return self.context.cast(self.builder, loaded, signature.return_type, resty)

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        """Store an element."""
        where = self._element(target_var, index_var)
        if where is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        array, given, cast = self.typeof(target_var.name), signature.args[2], self.context.cast
        value = cast(self.builder, self.loadvar(value_var.name), self.typeof(value_var.name), given)
        return store_item(self.context, self.builder, array, cast(self.builder, value, given, array.dtype), where)

    def _alloca_var(self, name: str, fetype: Any) -> None:
        if name not in self._index_only:
            super()._alloca_var(name, fetype)

    def delvar(self, name: str) -> None:
        """Forget nothing of an index: it takes no memory."""
        if name not in self._index_only:
            super().delvar(name)


def _index_of(one: Any) -> ir.Var | None:
    """Return the variable that an element is asked for with, also where its value is known beforehand."""
    return one.index if isinstance(one.index, ir.Var) else one.index_var


def _is_element(array: types.Type, index: types.Type) -> bool:
    if not isinstance(array, types.Array) or not isinstance(
        array.dtype, types.Integer | types.Float | types.Boolean | types.Record
    ):
        return False
    axes = tuple(index) if isinstance(index, types.BaseTuple) else (index,)
    return len(axes) == array.ndim and all(isinstance(one, types.Integer) for one in axes)


def _index_only(statements: Iterable[Any], typeof: Any) -> set[str]:
    """Return the tuples of integers, assigned once, that no statement uses but as the index of an element."""
    found: set[str] = set()
    same: list[tuple[str, str]] = []  # copies, which python makes for a[i, j] += b
    assigned: set[str] = set()
    unfit: set[str] = set()
    for one in statements:
        if isinstance(one, ir.Assign):
            name, value = one.target.name, one.value
            if name in assigned:
                unfit.add(name)
            assigned.add(name)
            if isinstance(value, ir.Expr) and value.op == "build_tuple":
                unfit.update(item.name for item in value.items)
                if all(isinstance(typeof(item.name), types.Integer) for item in value.items):
                    found.add(name)
            elif isinstance(value, ir.Var):
                if value.name in found:
                    found.add(name)
                    same.append((name, value.name))
            elif isinstance(value, ir.Expr):
                index = _index_of(value) if value.op in GETS else None
                fits = index is not None and _is_element(typeof(value.value.name), typeof(index.name))
                unfit.update(var.name for var in value.list_vars() if not (fits and var is index))
        elif isinstance(one, ir.SetItem | ir.StaticSetItem):
            index = _index_of(one)
            fits = index is not None and _is_element(typeof(one.target.name), typeof(index.name))
            unfit.update(var.name for var in one.list_vars() if not (fits and var is index))
        elif not isinstance(one, ir.Del):
            unfit.update(var.name for var in one.list_vars())
    for name, source in reversed(same):  # a copy that is used otherwise spoils its source, and that its other copies
        if name in unfit:
            unfit.add(source)
    for name, source in same:
        if source in unfit:
            unfit.add(name)
    return found - unfit
