"""Numbers: consecutive elements of a longer array, for compiled code.

They consist of a pointer and a length, so a kernel receives them in two registers. Unlike a slice
of a NumPy array, they do not keep the array alive; it must outlive them.
"""

from __future__ import annotations

import operator
from typing import Any

from numba import types
from numba.core import cgutils
from numba.cpython import slicing
from numba.extending import (
    intrinsic,
    lower_builtin,
    models,
    overload,
    register_model,
    type_callable,
)


class NumbersType(types.Type):
    """The Numba type of consecutive numbers of type `dtype`."""

    def __init__(self, dtype: types.Type) -> None:
        self.dtype = dtype
        super().__init__(name=f"Numbers({dtype})")


@register_model(NumbersType)
class _NumbersModel(models.StructModel):
    def __init__(self, manager: Any, fe_type: NumbersType) -> None:
        members = [("data", types.CPointer(fe_type.dtype)), ("length", types.intp)]
        super().__init__(manager, fe_type, members)


@intrinsic
def part(typingctx, values, offset, i):  # type: ignore[no-untyped-def]
    """Return the part of `values` from `offset[i]` to `offset[i + 1]` - 1."""
    result_type = NumbersType(values.dtype)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        source = context.make_array(values)(context, builder, arguments[0])
        table = context.make_array(offset)(context, builder, arguments[1])
        first_pointer = builder.gep(table.data, [arguments[2]])
        first = builder.load(first_pointer)
        last = builder.load(cgutils.gep_inbounds(builder, first_pointer, 1))
        result = cgutils.create_struct_proxy(result_type)(context, builder)
        result.data = builder.gep(source.data, [first])
        result.length = builder.sub(last, first)
        return result._getvalue()

    return result_type(values, offset, types.intp), generate


@type_callable(operator.getitem)
def _type_getitem(context):  # type: ignore[no-untyped-def]
    def typer(numbers, index):  # type: ignore[no-untyped-def]
        if not isinstance(numbers, NumbersType):
            return None
        if isinstance(index, types.Integer):
            return numbers.dtype
        return numbers if isinstance(index, types.SliceType) and not index.has_step else None

    return typer


@lower_builtin(operator.getitem, NumbersType, types.Integer)
def _getitem(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    numbers_type, index_type = signature.args
    numbers = cgutils.create_struct_proxy(numbers_type)(context, builder, value=arguments[0])
    index = context.cast(builder, arguments[1], index_type, types.intp)
    return builder.load(builder.gep(numbers.data, [index]))


@lower_builtin(operator.getitem, NumbersType, types.SliceType)
def _getslice(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    numbers_type, slice_type = signature.args
    numbers = cgutils.create_struct_proxy(numbers_type)(context, builder, value=arguments[0])
    bounds = context.make_helper(builder, slice_type, arguments[1])
    slicing.fix_slice(builder, bounds, numbers.length)
    result = cgutils.create_struct_proxy(numbers_type)(context, builder)
    result.data = builder.gep(numbers.data, [bounds.start])
    result.length = slicing.get_slice_length(builder, bounds)
    return result._getvalue()


@intrinsic
def _count(typingctx, numbers):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return cgutils.create_struct_proxy(numbers)(context, builder, value=arguments[0]).length

    return types.intp(numbers), generate


@overload(len)
def _len(numbers):  # type: ignore[no-untyped-def]
    return (lambda numbers: _count(numbers)) if isinstance(numbers, NumbersType) else None
