"""Jets: lanes with their derivatives, so that compiled code also differentiates what it computes.

A jet holds the value of a quantity and its derivatives by a fixed number of variables, of first or
of first and second order (truncated Taylor arithmetic; Griewank and Walther, "Evaluating
Derivatives", 2008, chapter 13). Code that is written for one particle, such as the kernel `step`
of dynamics, computes exact derivatives when it is called with jets. Jets support what lanes do,
except `np.any`; comparisons compare the values.

The components of a jet are in the order: value; first derivatives; second derivatives by the
variables (0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), ...
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
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
    type_callable,
)

from gameinfer_ros.lanes.blocks import BlockModel, BlockType, data_and_shape, make_block
from gameinfer_ros.lanes.lanes import DOUBLE, LanesType, MaskType, as_vector, extremum, fma


class JetType(types.Type):
    """The Numba type of `width` jets, one in each lane, with derivatives up to an order."""

    def __init__(self, width: int, variables: int, order: int) -> None:
        self.width, self.variables, self.order = width, variables, order
        self.pairs = [(a, b) for b in range(variables) for a in range(b + 1)] if order > 1 else []
        self.size = 1 + variables + len(self.pairs)
        super().__init__(name=f"Jet({width}, {variables}, {order})")

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Any:
        """Allow constants, which are numbers or lanes, where jets are expected."""
        return Conversion.safe if isinstance(other, types.Number | LanesType) else None


@register_model(JetType)
class _JetModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: JetType) -> None:
        lanes = ir.VectorType(DOUBLE, fe_type.width)
        super().__init__(manager, fe_type, ir.ArrayType(lanes, fe_type.size))


class JetBlockType(BlockType):
    """The Numba type of an array of jets with one axis."""

    def __init__(self, jet: JetType) -> None:
        super().__init__(1, jet.width)
        self.element, self.stride = jet, jet.width * jet.size
        self.name = f"Block({jet.name})"


register_model(JetBlockType)(BlockModel)


# --- Arithmetic --------------------------------------------------------------------------------


class _Jet:
    """The components of a jet in generated code; a constant has only a value."""

    def __init__(self, context, builder, result, kind, value):  # type: ignore[no-untyped-def]
        self.of = result
        if isinstance(kind, JetType):
            self.all = [builder.extract_value(value, j) for j in range(result.size)]
        else:
            self.all = [as_vector(context, builder, kind, value, result.width)]

    @property
    def constant(self) -> bool:
        return len(self.all) == 1

    @property
    def value(self) -> ir.Value:
        return self.all[0]

    def first(self, a: int) -> ir.Value:
        return self.all[1 + a]

    def seconds(self) -> Any:
        """Yield the variables and the value of each second derivative."""
        start = 1 + self.of.variables
        return zip(self.of.pairs, self.all[start:], strict=True)


def _zero(result: JetType) -> ir.Constant:
    return ir.Constant(ir.VectorType(DOUBLE, result.width), None)


def _add(builder: Any, a: _Jet, b: _Jet) -> list[ir.Value]:
    value = builder.fadd(a.value, b.value)
    if a.constant or b.constant:
        return [value, *(b if a.constant else a).all[1:]]
    return [value, *map(builder.fadd, a.all[1:], b.all[1:])]


def _neg(builder: Any, a: _Jet) -> list[ir.Value]:
    return [builder.fneg(part) for part in a.all]


def _sub(builder: Any, a: _Jet, b: _Jet) -> list[ir.Value]:
    value = builder.fsub(a.value, b.value)
    if b.constant:
        return [value, *a.all[1:]]
    if a.constant:
        return [value, *(builder.fneg(part) for part in b.all[1:])]
    return [value, *map(builder.fsub, a.all[1:], b.all[1:])]


def _mul(builder: Any, a: _Jet, b: _Jet) -> list[ir.Value]:
    if a.constant or b.constant:
        factor, jet = (a, b) if a.constant else (b, a)
        return [builder.fmul(factor.value, part) for part in jet.all]
    mul, add = builder.fmul, builder.fadd
    parts = [mul(a.value, b.value)]
    for i in range(a.of.variables):
        parts.append(add(mul(a.value, b.first(i)), mul(a.first(i), b.value)))
    for ((i, j), a_ij), (_, b_ij) in zip(a.seconds(), b.seconds(), strict=True):
        outer = add(mul(a.value, b_ij), mul(a_ij, b.value))
        inner = add(mul(a.first(i), b.first(j)), mul(a.first(j), b.first(i)))
        parts.append(add(outer, inner))
    return parts


def _div(builder: Any, a: _Jet, b: _Jet) -> list[ir.Value]:
    div, mul, sub = builder.fdiv, builder.fmul, builder.fsub
    if b.constant:
        return [div(part, b.value) for part in a.all]
    if a.constant:
        a.all += [_zero(a.of)] * (a.of.size - 1)
    q = div(a.value, b.value)
    parts = [q]
    for i in range(a.of.variables):
        parts.append(div(sub(a.first(i), mul(q, b.first(i))), b.value))
    for ((i, j), a_ij), (_, b_ij) in zip(a.seconds(), b.seconds(), strict=True):
        rest = sub(a_ij, mul(q, b_ij))
        for one, other in ((i, j), (j, i)):
            rest = sub(rest, mul(parts[1 + one], b.first(other)))
        parts.append(div(rest, b.value))
    return parts


def _fma(builder: Any, a: _Jet, b: _Jet, c: _Jet) -> list[ir.Value]:
    product_ = _Jet.__new__(_Jet)
    product_.of, product_.all = a.of, _mul(builder, a, b)
    return _add(builder, product_, c)


def _select(builder: Any, mask: ir.Value, a: _Jet, b: _Jet) -> list[ir.Value]:
    for jet in (a, b):
        if jet.constant:
            jet.all += [_zero(a.of)] * (a.of.size - 1)
    return [builder.select(mask, x, y) for x, y in zip(a.all, b.all, strict=True)]


def _extremum(predicate: str) -> Any:
    def generate(builder, a, b):  # type: ignore[no-untyped-def]
        chosen = builder.fcmp_unordered(predicate, a.value, b.value)
        _, *derivatives = _select(builder, chosen, a, b)
        return [extremum(predicate)(builder, a.value, b.value), *derivatives]

    return generate


def _pack(builder: Any, result: JetType, parts: list[ir.Value]) -> ir.Value:
    parts = parts + [_zero(result)] * (result.size - len(parts))
    jet = ir.Constant(ir.ArrayType(ir.VectorType(DOUBLE, result.width), result.size), ir.Undefined)
    for j, part in enumerate(parts):
        jet = builder.insert_value(jet, part, j)
    return jet


_Constant = types.Number | LanesType


def _joint_type(values: Any) -> JetType | None:
    """Return the type of the jets among some values, if the others are constants."""
    jets = {value for value in values if isinstance(value, JetType)}
    fits = all(isinstance(value, JetType | types.Number | LanesType) for value in values)
    return jets.pop() if len(jets) == 1 and fits else None


def _register(function: Any, arity: int, generate: Any) -> None:
    """Register a function of jets, of which some arguments may be constants."""

    @type_callable(function)
    def typing(context):  # type: ignore[no-untyped-def]
        return (
            lambda a: _joint_type((a,)),
            lambda a, b: _joint_type((a, b)),
            lambda a, b, c: _joint_type((a, b, c)),
        )[arity - 1]

    def lower(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        result = signature.return_type
        jets = [
            _Jet(context, builder, result, kind, value)
            for kind, value in zip(signature.args, arguments, strict=True)
        ]
        return _pack(builder, result, generate(builder, *jets))

    for kinds in product((JetType, types.Number, LanesType), repeat=arity):
        if JetType in kinds:
            lower_builtin(function, *kinds)(lower)


for _function, _arity, _generate in (
    (operator.add, 2, _add),
    (operator.sub, 2, _sub),
    (operator.mul, 2, _mul),
    (operator.iadd, 2, _add),
    (operator.isub, 2, _sub),
    (operator.imul, 2, _mul),
    (operator.truediv, 2, _div),
    (operator.neg, 1, _neg),
    (np.maximum, 2, _extremum(">")),
    (np.minimum, 2, _extremum("<")),
    (fma, 3, _fma),
):
    _register(_function, _arity, _generate)


def _register_comparison(function: Any, predicate: str, compare: str) -> None:
    @type_callable(function)
    def typing(context):  # type: ignore[no-untyped-def]
        def typer(a, b):  # type: ignore[no-untyped-def]
            jet = _joint_type((a, b))
            return jet and MaskType(jet.width)

        return typer

    def lower(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        jet = _joint_type(signature.args)
        a, b = (
            _Jet(context, builder, jet, kind, value).value
            for kind, value in zip(signature.args, arguments, strict=True)
        )
        return getattr(builder, compare)(predicate, a, b)

    for kinds in product((JetType, types.Number, LanesType), repeat=2):
        if JetType in kinds:
            lower_builtin(function, *kinds)(lower)


for _function, _predicate in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _register_comparison(_function, _predicate, "fcmp_ordered")
_register_comparison(operator.ne, "!=", "fcmp_unordered")


@type_callable(np.where)
def _type_where(context):  # type: ignore[no-untyped-def]
    def typer(mask, a, b):  # type: ignore[no-untyped-def]
        return _joint_type((a, b)) if isinstance(mask, MaskType) else None

    return typer


def _where(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
    result = signature.return_type
    a, b = (
        _Jet(context, builder, result, kind, value)
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True)
    )
    return _pack(builder, result, _select(builder, arguments[0], a, b))


for _kinds in product((JetType, types.Number, LanesType), repeat=2):
    if JetType in _kinds:
        lower_builtin(np.where, MaskType, *_kinds)(_where)


@lower_cast(types.Number, JetType)
@lower_cast(LanesType, JetType)
def _cast(context, builder, source, target, value):  # type: ignore[no-untyped-def]
    return _pack(builder, target, _Jet(context, builder, target, source, value).all)


# --- Functions of one variable -----------------------------------------------------------------


@intrinsic
def value_of(typingctx, jet):  # type: ignore[no-untyped-def]
    """Return the value of a jet, as lanes."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.extract_value(arguments[0], 0)

    return LanesType(jet.width)(jet), generate


@intrinsic
def compose(typingctx, jet, value, slope, curvature):  # type: ignore[no-untyped-def]
    """Return f(jet) from the value f, the slope f' and the curvature f'' at its value."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        x = _Jet(context, builder, jet, jet, arguments[0])
        f, f_1, f_2 = (
            as_vector(context, builder, kind, part, jet.width)
            for kind, part in zip(signature.args[1:], arguments[1:], strict=True)
        )
        mul, add = builder.fmul, builder.fadd
        parts = [f, *(mul(f_1, x.first(i)) for i in range(jet.variables))]
        for (i, j), x_ij in x.seconds():
            parts.append(add(mul(f_1, x_ij), mul(f_2, mul(x.first(i), x.first(j)))))
        return _pack(builder, jet, parts)

    return jet(jet, value, slope, curvature), generate


def _overload(function: Any, implementation: Any) -> None:
    @overload(function)
    def of_jet(x):  # type: ignore[no-untyped-def]
        return implementation if isinstance(x, JetType) else None


def _sin(x):  # type: ignore[no-untyped-def]
    s = np.sin(value_of(x))
    return compose(x, s, np.cos(value_of(x)), -s)


def _cos(x):  # type: ignore[no-untyped-def]
    c = np.cos(value_of(x))
    return compose(x, c, -np.sin(value_of(x)), -c)


def _sqrt(x):  # type: ignore[no-untyped-def]
    root = np.sqrt(value_of(x))
    return compose(x, root, 0.5 / root, -0.25 / (root * value_of(x)))


def _abs(x):  # type: ignore[no-untyped-def]
    v = value_of(x)
    return compose(x, np.abs(v), np.where(v < 0.0, -1.0, 1.0), 0.0)


def _floor(x):  # type: ignore[no-untyped-def]
    return compose(x, np.floor(value_of(x)), 0.0, 0.0)


def _rint(x):  # type: ignore[no-untyped-def]
    return compose(x, np.rint(value_of(x)), 0.0, 0.0)


_overload(np.sin, _sin)
_overload(np.cos, _cos)
_overload(np.sqrt, _sqrt)
_overload(np.abs, _abs)
_overload(np.floor, _floor)
_overload(np.rint, _rint)


# --- Blocks of jets ----------------------------------------------------------------------------


def _jet_block(context, builder, block_type, count):  # type: ignore[no-untyped-def]
    """Create a block of jets on the stack."""
    memory = ir.ArrayType(DOUBLE, count * block_type.stride)
    data = builder.bitcast(cgutils.alloca_once(builder, memory), DOUBLE.as_pointer())
    return data, make_block(context, builder, block_type, data, [ir.IntType(64)(count)])


@intrinsic(prefer_literal=True)
def as_variables(typingctx, values, count, first, variables, order):  # type: ignore[no-untyped-def]
    """Return a block of jets that are variables with the given values.

    `values` is a block (count,) of lanes. The jets are the variables from `first` on, of
    `variables` variables; the order of the derivatives is 1 or 2. All arguments but the first are
    constants. The block is on the stack of the caller.
    """
    if not all(isinstance(n, types.IntegerLiteral) for n in (count, first, variables, order)):
        return None
    n, offset = count.literal_value, first.literal_value
    jet = JetType(values.width, variables.literal_value, order.literal_value)
    block_type = JetBlockType(jet)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        lanes = ir.VectorType(DOUBLE, jet.width)
        data, result = _jet_block(context, builder, block_type, n)
        source, _ = data_and_shape(context, builder, values, arguments[0])
        source = builder.bitcast(source, lanes.as_pointer())
        target = builder.bitcast(data, lanes.as_pointer())
        for i in range(n):
            value = builder.load(cgutils.gep_inbounds(builder, source, i), align=8)
            parts = [
                value,
                *(lanes([float(j == offset + i)] * jet.width) for j in range(jet.variables)),
            ]
            parts += [lanes(None)] * (jet.size - len(parts))
            for j, part in enumerate(parts):
                pointer = cgutils.gep_inbounds(builder, target, i * jet.size + j)
                builder.store(part, pointer, align=8)
        return result

    return block_type(values, count, first, variables, order), generate


@intrinsic(prefer_literal=True)
def alike(typingctx, jets, count):  # type: ignore[no-untyped-def]
    """Return a block of `count` (a constant) jets of the same kind, on the stack of the caller."""
    if not isinstance(count, types.IntegerLiteral):
        return None

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _jet_block(context, builder, jets, count.literal_value)[1]

    return jets(jets, count), generate


@intrinsic
def components(typingctx, jets):  # type: ignore[no-untyped-def]
    """View a block of n jets as a block (n, size) of lanes, its components."""
    block_type = BlockType(2, jets.width)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data, (count,) = data_and_shape(context, builder, jets, arguments[0])
        shape = [count, ir.Constant(count.type, jets.element.size)]
        return make_block(context, builder, block_type, data, shape)

    return block_type(jets), generate
