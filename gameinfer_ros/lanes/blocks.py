"""Blocks: arrays of lanes, for compiled code.

A block is a view of a C-contiguous NumPy array whose last axis has the length `width`. The block
does not have that axis: its elements are lanes, `width` numbers, one for each particle.

    x = block(array, 8)            # from array (n, 8)
    x[0] += x[1] * x[2]

A block does not own its memory; the array must outlive it.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import (
    intrinsic,
    lower_builtin,
    models,
    overload,
    register_model,
    type_callable,
)

from gameinfer_ros.lanes.array import WIDE as WIDE
from gameinfer_ros.lanes.lanes import LanesType, as_vector


def in_blocks(array: np.ndarray) -> np.ndarray:
    """Split `array` (..., K) along the particles into blocks (blocks, ..., width).

    The width is 1 for one particle and `WIDE` for several. Copies of the last particle fill the
    last block.
    """
    particles = array.shape[-1]
    if particles == 1:
        return np.array(array[None], dtype=float, order="C")
    blocks = -(-particles // WIDE)
    filled = np.minimum(np.arange(blocks * WIDE), particles - 1)
    taken = np.take(array, filled, axis=-1).reshape(*array.shape[:-1], blocks, WIDE)
    return np.ascontiguousarray(np.moveaxis(taken, -2, 0), dtype=float)


def from_blocks(blocks: np.ndarray, particles: int) -> np.ndarray:
    """Join `blocks` (blocks, ..., width) to an array (..., K) of K particles; see `in_blocks`."""
    joined = np.moveaxis(blocks, 0, -2)
    lanes = joined.shape[-2] * joined.shape[-1]
    return joined.reshape(*joined.shape[:-2], lanes)[..., :particles]


def aligned_zeros(*shape: int) -> np.ndarray:
    """Create zeros that are aligned to cache lines, so that no lanes straddle two of them."""
    line = 64
    size = int(np.prod(shape))
    memory = np.zeros(size + line // 8)
    first = -memory.ctypes.data % line // 8
    return memory[first : first + size].reshape(shape)


class BlockType(types.Type):
    """The Numba type of an array of lanes with `ndim` axes."""

    def __init__(self, ndim: int, width: int) -> None:
        self.ndim = ndim
        self.width = width
        #: Numbers from one element to the next.
        self.stride = width
        self.dtype: types.Type = types.float64
        self.element: types.Type = LanesType(width)
        super().__init__(name=f"Block({ndim}, {width})")


class BlockModel(models.StructModel):
    """The memory layout of a block: a pointer to its first number, and its lengths."""

    def __init__(self, manager: Any, fe_type: BlockType) -> None:
        members = [
            ("data", types.CPointer(fe_type.dtype)),
            ("shape", types.UniTuple(types.intp, fe_type.ndim)),
        ]
        super().__init__(manager, fe_type, members)


register_model(BlockType)(BlockModel)


def make_block(context, builder, block_type, data, shape):  # type: ignore[no-untyped-def]
    """Create a block from a pointer and its lengths; for code generators."""
    result = cgutils.create_struct_proxy(block_type)(context, builder)
    result.data = data
    result.shape = cgutils.pack_array(builder, shape)
    return result._getvalue()


def data_and_shape(context, builder, block_type, value):  # type: ignore[no-untyped-def]
    """Return the pointer and the lengths of a block; for code generators."""
    source = cgutils.create_struct_proxy(block_type)(context, builder, value=value)
    return source.data, cgutils.unpack_tuple(builder, source.shape, block_type.ndim)


@intrinsic(prefer_literal=True)
def block(typingctx, array, width):  # type: ignore[no-untyped-def]
    """View a C-contiguous array, whose last axis has the constant length `width`, as a block.

    Instead of a literal number, `width` may be a tuple of that length.
    """
    if isinstance(width, types.IntegerLiteral):
        block_type = BlockType(array.ndim - 1, width.literal_value)
    elif isinstance(width, types.BaseTuple):
        block_type = BlockType(array.ndim - 1, len(width))
    else:
        return None

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        source = context.make_array(array)(context, builder, arguments[0])
        shape = cgutils.unpack_tuple(builder, source.shape, array.ndim)
        return make_block(context, builder, block_type, source.data, shape[:-1])

    return block_type(array, width), generate


@intrinsic
def rows(typingctx, whole, start, stop):  # type: ignore[no-untyped-def]
    """Return the rows from `start` to `stop` - 1 of a block."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        pointer = _pointer(context, builder, whole, arguments[0], arguments[1:2])
        _, shape = data_and_shape(context, builder, whole, arguments[0])
        shape[0] = builder.sub(arguments[2], arguments[1])
        return make_block(context, builder, whole, pointer, shape)

    return whole(whole, types.intp, types.intp), generate


@intrinsic(prefer_literal=True)
def adjacent(typingctx, row, count):  # type: ignore[no-untyped-def]
    """View a block (n,) of width 1 as a block (n // count,) of width `count`, a constant.

    With a single particle, this processes the columns of a matrix side by side.
    """
    if not (row.width == 1 and isinstance(count, types.IntegerLiteral)):
        return None
    block_type = BlockType(1, count.literal_value)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data, (length,) = data_and_shape(context, builder, row, arguments[0])
        groups = builder.sdiv(length, ir.Constant(length.type, block_type.width))
        return make_block(context, builder, block_type, data, [groups])

    return block_type(row, count), generate


@intrinsic
def reshaped(typingctx, whole, first, second):  # type: ignore[no-untyped-def]
    """View a block of one axis as a block of two axes with these lengths."""
    block_type = BlockType(2, whole.width)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data, _ = data_and_shape(context, builder, whole, arguments[0])
        return make_block(context, builder, block_type, data, arguments[1:])

    return block_type(whole, types.intp, types.intp), generate


def _pointer(context, builder, block_type, value, index):  # type: ignore[no-untyped-def]
    """Return the pointer to an element, or to a sub-block if the index is shorter than `ndim`."""
    data, shape = data_and_shape(context, builder, block_type, value)
    offset = index[0]
    for axis in range(1, block_type.ndim):
        offset = builder.mul(offset, shape[axis], flags=["nsw"])
        if axis < len(index):
            offset = builder.add(offset, index[axis], flags=["nsw"])
    offset = builder.mul(offset, ir.Constant(offset.type, block_type.stride), flags=["nsw"])
    return builder.gep(data, [offset], inbounds=True)


def _index_types(index: Any) -> tuple[Any, ...]:
    return tuple(index) if isinstance(index, types.BaseTuple) else (index,)


def _indices(context, builder, index_type, index):  # type: ignore[no-untyped-def]
    kinds, parts = _index_types(index_type), [index]
    if isinstance(index_type, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, index, len(kinds))
    return [context.cast(builder, parts[j], kinds[j], types.intp) for j in range(len(kinds))]


@type_callable(operator.getitem)
def _type_getitem(context):  # type: ignore[no-untyped-def]
    def typer(whole, index):  # type: ignore[no-untyped-def]
        if not isinstance(whole, BlockType):
            return None
        parts = _index_types(index)
        if not all(isinstance(part, types.Integer) for part in parts):
            return None
        if len(parts) == whole.ndim:
            return whole.element
        return BlockType(whole.ndim - len(parts), whole.width)

    return typer


@lower_builtin(operator.getitem, BlockType, types.Any)
def _getitem(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    whole, index_type = signature.args
    index = _indices(context, builder, index_type, arguments[1])
    pointer = _pointer(context, builder, whole, arguments[0], index)
    if len(index) == whole.ndim:
        element = context.get_value_type(whole.element)
        return builder.load(builder.bitcast(pointer, element.as_pointer()), align=8)
    _, shape = data_and_shape(context, builder, whole, arguments[0])
    return make_block(context, builder, signature.return_type, pointer, shape[len(index) :])


@type_callable(operator.setitem)
def _type_setitem(context):  # type: ignore[no-untyped-def]
    def typer(whole, index, value):  # type: ignore[no-untyped-def]
        if (
            isinstance(whole, BlockType)
            and whole.element != whole.dtype  # numbers are read-only
            and len(_index_types(index)) == whole.ndim
            and (value == whole.element or isinstance(value, LanesType | types.Number))
        ):
            return types.void
        return None

    return typer


@lower_builtin(operator.setitem, BlockType, types.Any, types.Any)
def _setitem(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    whole, index_type, value_type = signature.args
    index = _indices(context, builder, index_type, arguments[1])
    value = arguments[2]
    if isinstance(whole.element, LanesType):
        value = as_vector(context, builder, value_type, value, whole.width)
    else:
        value = context.cast(builder, value, value_type, whole.element)
    pointer = _pointer(context, builder, whole, arguments[0], index)
    builder.store(value, builder.bitcast(pointer, value.type.as_pointer()), align=8)


@overload(len)
def _len(whole):  # type: ignore[no-untyped-def]
    return (lambda whole: length(whole, 0)) if isinstance(whole, BlockType) else None


@intrinsic(prefer_literal=True)
def length(typingctx, whole, axis):  # type: ignore[no-untyped-def]
    """Return the length of one axis, a constant, of a block."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return data_and_shape(context, builder, whole, arguments[0])[1][axis.literal_value]

    return types.intp(whole, axis), generate
