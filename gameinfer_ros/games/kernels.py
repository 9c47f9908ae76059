"""The signatures of compiled kernels, and the tables of kernels that make up one game.

Dynamics and cost terms give the solver small functions. Each works on *one step* of the horizon,
and is written as if there were one particle; the compiler makes it work on several at once, each
in a lane of its own (see `gameinfer_ros.games.lanes`).

| symbol | shape | meaning |
|---|---|---|
| n, m | | states and inputs of one player |
| nx | | states of all players, player after player |
| t | scalar | time of the step, in s, on the clock that starts with the run |
| x | (n,) or (nx,) | state of one player (dynamics) or of all (cost terms) |
| u | (m,) | the player's own input |
| index | (...,) | integers that a term was bound to, such as rows of x |
| params | (...,) | numbers of the dynamics or of the term, such as weights |

A kernel is one of these:

- `step(x, u, dt, params, x_next)` writes the state (n,) one step of `dt` seconds later.
- `linearise(x, u, dt, params, A, B)` writes those items of A (n, n) and B (n, m) of
  x_next = A x + B u that are not 0; the others are 0 already.
- `cost(t, x, u, index, params)` returns the term's cost at this step.
- `quadraticise(t, x, u, index, params, Q, q, R, r)` adds the second and first derivatives of the
  term by x to Q (nx, nx) and q (nx,), those by u to R (m, m) and r (m,).

Called from Python, a kernel takes NumPy arrays, which may have particles as a further, last axis.

Kernels are passed around by address. The passes that call them therefore need not be compiled
again when a game has other players or terms, and Numba's disk cache serves every game.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import float64, int64, njit, types
from numba.typed import List

from gameinfer_ros.games.blocks import BlockType
from gameinfer_ros.games.lanes import LanesType

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gameinfer_ros.games.cost_term import BoundTerm
    from gameinfer_ros.games.dynamics import Dynamics

#: In the signatures of kernels, which Numba infers for itself.
Array = Any

_VECTOR = types.Array(float64, 1, "C")
_INDEX = types.Array(int64, 1, "C")


class Signatures(NamedTuple):
    """Types of the kernels, for particles in so many lanes."""

    step: types.FunctionType
    linearise: types.FunctionType
    cost: types.FunctionType
    quadraticise: types.FunctionType

    @classmethod
    def of_width(cls, width: int) -> Signatures:
        """Types of the kernels for `width` lanes."""
        lanes, row, matrix = LanesType(width), BlockType(1, width), BlockType(2, width)
        dynamics = (row, row, float64, _VECTOR)
        term = (float64, row, row, _INDEX, _VECTOR)
        return cls(
            types.FunctionType(types.void(*dynamics, row)),
            types.FunctionType(types.void(*dynamics, matrix, matrix)),
            types.FunctionType(lanes(*term)),
            types.FunctionType(types.void(*term, matrix, row, matrix, row)),
        )


def kernel(function: Any) -> Any:
    """Compile a kernel, with Numba's disk cache."""
    return njit(function, cache=True, error_model="numpy")


class GameKernels(NamedTuple):
    """Everything compiled code needs to know of a game, as tables.

    An offset table tells where each item's part of a longer array begins and the previous one's
    ends: player i owns the states `state_offset[i]:state_offset[i + 1]` of the joint state, and
    the terms `term_offset[i]:term_offset[i + 1]`; term j owns a part of `term_index` and one of
    `term_params`.
    """

    dt: float
    state_offset: Array
    input_offset: Array
    step: Any
    linearise: Any
    dynamics_params_offset: Array
    dynamics_params: Array
    term_offset: Array
    cost: Any
    quadraticise: Any
    term_index_offset: Array
    term_index: Array
    term_params_offset: Array
    term_params: Array


def tabulate(
    dt: float, dynamics: Sequence[Dynamics], terms: Sequence[Sequence[BoundTerm]], width: int
) -> GameKernels:
    """Tables of the kernels of players with these `dynamics` and `terms` (one list a player).

    The kernels, for `width` lanes, are compiled here if the disk cache does not hold them yet.
    """
    signatures = Signatures.of_width(width)
    flat = [term for of_player in terms for term in of_player]
    return GameKernels(
        dt,
        _offsets([d.n_states for d in dynamics]),
        _offsets([d.n_inputs for d in dynamics]),
        _functions(signatures.step, [type(d).step_kernel for d in dynamics]),
        _functions(signatures.linearise, [type(d).linearise_kernel for d in dynamics]),
        _offsets([len(d.params) for d in dynamics]),
        _flat([d.params for d in dynamics], float),
        _offsets([len(of_player) for of_player in terms]),
        _functions(signatures.cost, [type(t.term).cost_kernel for t in flat]),
        _functions(signatures.quadraticise, [type(t.term).quadraticise_kernel for t in flat]),
        _offsets([len(t.index) for t in flat]),
        _flat([t.index for t in flat], np.int64),
        _offsets([len(t.params) for t in flat]),
        _flat([t.params for t in flat], float),
    )


def _offsets(lengths: Sequence[int]) -> Array:
    return np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)


def _flat(rows: Sequence[Sequence[float]], dtype: Any) -> Array:
    return np.array([value for row in rows for value in row], dtype=dtype)


def _functions(signature: Any, functions: Sequence[Any]) -> Any:
    new, append = _table_of(signature)
    table = new()
    for function in functions:
        append(table, function)
    return table


@cache
def _table_of(signature: Any) -> tuple[Any, Any]:
    # The methods of a list made outside compiled code would be compiled in every process: 2 s.
    table_type = types.ListType(signature)

    @njit(table_type(), cache=True)
    def new() -> Any:
        return List.empty_list(signature)

    @njit(types.void(table_type, signature), cache=True)
    def append(table: Any, function: Any) -> None:
        table.append(function)

    return new, append


@njit(cache=True, inline="always")
def part(values: Array, offset: Array, i: int) -> Array:
    """Item i's part of `values`, by its table of offsets."""
    return values[offset[i] : offset[i + 1]]
