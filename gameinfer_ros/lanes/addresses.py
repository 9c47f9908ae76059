"""Calls of compiled functions by address: callers need not be recompiled for each function."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gameinfer_ros.lanes.blocks import BlockType


def address(function: Any, result: types.Type, arguments: tuple[types.Type, ...]) -> int:
    """Return the address of a Numba function, and compile it if necessary.

    The address is valid as long as the function exists.

    Args:
        function: the function.
        result: type that the function must return.
        arguments: types of the arguments.

    Raises:
        TypeError: the function returns another type than `result`.
    """
    function.compile(arguments)
    compiled = function.overloads[arguments]
    if compiled.signature.return_type != result:
        raise TypeError(
            f"{function.__name__}: it must return {result}, but returns "
            f"{compiled.signature.return_type}"
        )
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def addresses(
    functions: Sequence[Any], result: types.Type, arguments: tuple[types.Type, ...]
) -> np.ndarray:
    """Return the addresses (n,) of Numba functions; see `address`."""
    return np.array([address(f, result, arguments) for f in functions], dtype=np.int64)


@intrinsic
def call(typingctx, at, arguments):  # type: ignore[no-untyped-def]
    """Call the function at an address with a tuple of arguments; it must return nothing.

    The types of the arguments must be exactly those given to `address`.
    """
    return types.none(at, arguments), _calling(types.none, arguments)


@intrinsic
def call_for_lanes(typingctx, at, arguments):  # type: ignore[no-untyped-def]
    """Call the function at an address; it must return lanes as wide as those of its arguments."""
    result = next(a.element for a in arguments.types if isinstance(a, BlockType))
    return result(at, arguments), _calling(result, arguments)


def _calling(result: types.Type, arguments: types.Tuple) -> Any:
    """Create the code generator of a call with Numba's convention, which propagates exceptions."""

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        convention = context.call_conv
        function_type = convention.get_function_type(result, arguments.types)
        function = builder.inttoptr(values[0], ir.PointerType(function_type))
        parts = cgutils.unpack_tuple(builder, values[1], len(arguments))
        status, returned = convention.call_function(
            builder, function, result, arguments.types, parts
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return returned

    return generate
