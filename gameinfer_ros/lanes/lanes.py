"""Lanes: one quantity of several particles, side by side in the processor's vector registers.

`LanesType` is a type for compiled code: `width` numbers, one for each particle, with the
operations of a single number. Code that is written for one particle thus processes several at
once. Lanes support arithmetic, comparisons, `np.sqrt`, `np.sin`, `np.cos`, `np.abs`, `np.floor`,
`np.rint`, `np.minimum`, `np.maximum`, `np.where`, `np.any` of a comparison, and `fma`. When called
from Python, the same code works on NumPy arrays.

All operations follow IEEE 754. The result in a lane therefore does not depend on its position, on
the other lanes or on their number.
"""

from __future__ import annotations

import operator
from itertools import product
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.extending import (
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
    type_callable,
)

from gameinfer_ros.lanes.array import Array as Array
from gameinfer_ros.lanes.compile_cache import njit

DOUBLE = ir.DoubleType()


class VectorType(types.Type):
    """The Numba type of `width` items, one in each lane."""

    item: ir.Type

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"{type(self).__name__.removesuffix('Type')}({width})")


class LanesType(VectorType):
    """The Numba type of `width` numbers, one in each lane."""

    item = DOUBLE

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Any:
        """Allow a number where lanes are expected; all lanes then have its value."""
        return Conversion.safe if isinstance(other, types.Number) else None


class MaskType(VectorType):
    """The Numba type of `width` booleans, one in each lane."""

    item = ir.IntType(1)


@register_model(LanesType)
@register_model(MaskType)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: VectorType) -> None:
        super().__init__(manager, fe_type, ir.VectorType(fe_type.item, fe_type.width))


# --- Arithmetic --------------------------------------------------------------------------------


def as_vector(context, builder, value_type, value, width):  # type: ignore[no-untyped-def]
    """Convert a number, or a single lane, to lanes with its value; return other lanes unchanged."""
    if not isinstance(value_type, LanesType):
        scalar = context.cast(builder, value, value_type, types.float64)
        single = ir.Constant(ir.VectorType(DOUBLE, 1), ir.Undefined)
        value = builder.insert_element(single, scalar, ir.Constant(ir.IntType(32), 0))
    elif value_type.width == width:
        return value
    every = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(value, ir.Constant(value.type, ir.Undefined), every)


@lower_cast(types.Number, LanesType)
def _cast(context, builder, source, target, value):  # type: ignore[no-untyped-def]
    return as_vector(context, builder, source, value, target.width)


def _vectors(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    width = max(a.width for a in signature.args if isinstance(a, LanesType))
    return [
        as_vector(context, builder, value_type, value, width)
        for value_type, value in zip(signature.args, arguments, strict=True)
    ]


def _register(function: Any, result: type[types.Type], arity: int, generate: Any) -> None:
    """Register a function of lanes and its code generator.

    Instead of lanes, some arguments may be numbers or have a single lane.
    """

    @type_callable(function)
    def typing(context):  # type: ignore[no-untyped-def]
        def of(*values):  # type: ignore[no-untyped-def]
            fits = all(isinstance(value, LanesType | types.Number) for value in values)
            widths = {value.width for value in values if isinstance(value, LanesType)}
            return result(max(widths)) if fits and len(widths - {1}) <= 1 and widths else None

        # Numba requires a fixed number of parameters.
        return (lambda a: of(a), lambda a, b: of(a, b), lambda a, b, c: of(a, b, c))[arity - 1]

    def lower(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return generate(builder, *_vectors(context, builder, signature, arguments))

    for kinds in product((LanesType, types.Number), repeat=arity):
        if LanesType in kinds:
            lower_builtin(function, *kinds)(lower)


def _llvm(name: str) -> Any:
    """Create the code generator of a call to an LLVM intrinsic on vectors."""

    def generate(builder, *vectors):  # type: ignore[no-untyped-def]
        vector = vectors[0].type
        function_type = ir.FunctionType(vector, [vector] * len(vectors))
        function = cgutils.get_or_insert_function(
            builder.module, function_type, f"llvm.{name}.v{vector.count}f64"
        )
        return builder.call(function, vectors)

    return generate


def _compare(predicate: str) -> Any:
    def generate(builder, a, b):  # type: ignore[no-untyped-def]
        return builder.fcmp_ordered(predicate, a, b)

    return generate


def extremum(predicate: str) -> Any:
    """Create the code generator of `np.maximum` or `np.minimum` on vectors."""

    def generate(builder, a, b):  # type: ignore[no-untyped-def]
        # As in NumPy, nan propagates.
        chosen = builder.select(builder.fcmp_unordered(predicate, a, b), a, b)
        return builder.select(builder.fcmp_unordered("uno", b, b), b, chosen)

    return generate


def fma(a: Any, b: Any, c: Any) -> Any:
    """Return a b + c; in compiled code, one instruction with a single rounding."""
    return a * b + c


for _function, _arity, _generate in (
    (operator.add, 2, ir.IRBuilder.fadd),
    (operator.sub, 2, ir.IRBuilder.fsub),
    (operator.mul, 2, ir.IRBuilder.fmul),
    (operator.iadd, 2, ir.IRBuilder.fadd),
    (operator.isub, 2, ir.IRBuilder.fsub),
    (operator.imul, 2, ir.IRBuilder.fmul),
    (operator.truediv, 2, ir.IRBuilder.fdiv),
    (operator.neg, 1, ir.IRBuilder.fneg),
    (np.sqrt, 1, _llvm("sqrt")),
    (np.abs, 1, _llvm("fabs")),
    (np.rint, 1, _llvm("rint")),
    (np.floor, 1, _llvm("floor")),
    (np.maximum, 2, extremum(">")),
    (np.minimum, 2, extremum("<")),
    (fma, 3, _llvm("fma")),
):
    _register(_function, LanesType, _arity, _generate)

for _function, _predicate in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _register(_function, MaskType, 2, _compare(_predicate))

# nan differs from everything, including itself.
_register(operator.ne, MaskType, 2, lambda builder, a, b: builder.fcmp_unordered("!=", a, b))


@type_callable(np.where)
def _type_where(context):  # type: ignore[no-untyped-def]
    def typer(mask, a, b):  # type: ignore[no-untyped-def]
        fits = all(isinstance(value, LanesType | types.Number) for value in (a, b))
        return LanesType(mask.width) if isinstance(mask, MaskType) and fits else None

    return typer


def _where(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    mask, a, b = signature.args
    return builder.select(
        arguments[0],
        as_vector(context, builder, a, arguments[1], mask.width),
        as_vector(context, builder, b, arguments[2], mask.width),
    )


for _kinds in product((LanesType, types.Number), repeat=2):
    lower_builtin(np.where, MaskType, *_kinds)(_where)


@type_callable(np.any)
def _type_any(context):  # type: ignore[no-untyped-def]
    return lambda mask: types.boolean if isinstance(mask, MaskType) else None


@lower_builtin(np.any, MaskType)
def _any(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    bits = ir.IntType(signature.args[0].width)
    return builder.icmp_unsigned("!=", builder.bitcast(arguments[0], bits), ir.Constant(bits, 0))


# --- Trigonometry ------------------------------------------------------------------------------

# Angles are reduced to [-pi/4, pi/4] by multiples of pi/2, stored in three parts of 33 bits so
# that multiples up to a million are exact. On that interval, the polynomials of fdlibm apply.
_HALF_PI_1, _HALF_PI_2, _HALF_PI_3 = (
    1.57079632673412561417,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)


@njit(error_model="numpy")
def _wave(x: Any, quarter_turns: float) -> Any:
    """Return sin(x + quarter_turns pi/2), accurate to 1e-15 for angles below a million turns."""
    k = np.rint(x * (2.0 / np.pi))
    r = ((x - k * _HALF_PI_1) - k * _HALF_PI_2) - k * _HALF_PI_3
    z = r * r
    sine = 1.58969099521155010221e-10 * z - 2.50507602534068634195e-08
    sine = sine * z + 2.75573137070700676789e-06
    sine = sine * z - 1.98412698298579493134e-04
    sine = sine * z + 8.33333333332248946124e-03
    sine = r + r * z * (sine * z - 1.66666666666666324348e-01)
    cosine = -1.13596475577881948265e-11 * z + 2.08757232129817482790e-09
    cosine = cosine * z - 2.75573143513906633035e-07
    cosine = cosine * z + 2.48015872894767294178e-05
    cosine = cosine * z - 1.38888888888741095749e-03
    cosine = 1.0 - 0.5 * z + z * z * (cosine * z + 4.16666666666666019037e-02)
    turns = 0.25 * (k + quarter_turns)
    quadrant = turns - np.floor(turns)  # 0, 1/4, 1/2 or 3/4
    value = np.where(quadrant == 0.25, cosine, sine)
    value = np.where(quadrant == 0.5, -sine, value)
    return np.where(quadrant == 0.75, -cosine, value)


@overload(np.sin)
def _sin(x):  # type: ignore[no-untyped-def]
    return (lambda x: _wave(x, 0.0)) if isinstance(x, LanesType) else None


@overload(np.cos)
def _cos(x):  # type: ignore[no-untyped-def]
    return (lambda x: _wave(x, 1.0)) if isinstance(x, LanesType) else None
