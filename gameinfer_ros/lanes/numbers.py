"""Numbers: consecutive elements of a longer array, for compiled code.

They consist of a pointer and a length, so a kernel receives them in two registers. Unlike a slice
of a NumPy array, they do not keep the array alive; it must outlive them.
"""

from __future__ import annotations

import operator

from numba import types
from numba.core import cgutils
from numba.cpython import slicing
from numba.extending import intrinsic, lower_builtin, register_model, type_callable

from gameinfer_ros.lanes.blocks import BlockModel, BlockType, data_and_shape, make_block


class NumbersType(BlockType):
    """The Numba type of consecutive numbers of type `dtype`, a read-only block without lanes."""

    def __init__(self, dtype: types.Type) -> None:
        super().__init__(1, 1)
        self.name = f"Numbers({dtype})"
        self.dtype = self.element = dtype


register_model(NumbersType)(BlockModel)


@intrinsic
def part(typingctx, values, offset, i):  # type: ignore[no-untyped-def]
    """Return the part of `values` from `offset[i]` to `offset[i + 1]` - 1."""
    result_type = NumbersType(values.dtype)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        source = context.make_array(values)(context, builder, arguments[0])
        table = context.make_array(offset)(context, builder, arguments[1])
        first_pointer = builder.gep(table.data, [arguments[2]])
        first = builder.load(first_pointer)
        count = builder.sub(builder.load(cgutils.gep_inbounds(builder, first_pointer, 1)), first)
        data = builder.gep(source.data, [first])
        return make_block(context, builder, result_type, data, [count])

    return result_type(values, offset, types.intp), generate


@type_callable(operator.getitem)
def _type_getslice(context):  # type: ignore[no-untyped-def]
    def typer(numbers, index):  # type: ignore[no-untyped-def]
        known = isinstance(numbers, NumbersType) and isinstance(index, types.SliceType)
        return numbers if known and not index.has_step else None

    return typer


@lower_builtin(operator.getitem, NumbersType, types.SliceType)
def _getslice(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    numbers_type, slice_type = signature.args
    data, (length,) = data_and_shape(context, builder, numbers_type, arguments[0])
    bounds = context.make_helper(builder, slice_type, arguments[1])
    slicing.fix_slice(builder, bounds, length)
    count = slicing.get_slice_length(builder, bounds)
    first = builder.gep(data, [bounds.start])
    return make_block(context, builder, numbers_type, first, [count])
