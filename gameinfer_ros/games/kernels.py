"""The signatures of compiled kernels, and the tables of kernels that make up one game.

Dynamics and cost terms give the solver small functions. Each works on *one step* of the horizon,
and is written as if there were one particle; the compiler makes it work on several at once, each
in a lane of its own (see `gameinfer_ros.lanes.lanes`).

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
  x_next = A x + B u that are not always 0, and always the same ones: the others are 0 already, and
  the solver leaves them out.
- `cost(t, x, u, index, params)` returns the term's cost at this step.
- `quadraticise(t, x, u, index, params, Q, q, R, r)` adds the second and first derivatives of the
  term by x to Q (nx, nx) and q (nx,), those by u to R (m, m) and r (m,).

Called from Python, a kernel takes NumPy arrays, which may have particles as a further, last axis.

Kernels are passed around by address. The passes that call them therefore need not be compiled
again when a game has other players or terms, and Numba's disk cache serves every game.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import float64, int64, njit, types

from gameinfer_ros.lanes.addresses import addresses
from gameinfer_ros.lanes.blocks import BlockType
from gameinfer_ros.lanes.lanes import Array, LanesType
from gameinfer_ros.lanes.numbers import NumbersType

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gameinfer_ros.games.costs.cost_term import BoundTerm
    from gameinfer_ros.games.dynamics.dynamics import Dynamics


class Signatures(NamedTuple):
    """Types of the arguments of the kernels, for particles in so many lanes."""

    step: tuple[types.Type, ...]
    linearise: tuple[types.Type, ...]
    cost: tuple[types.Type, ...]
    quadraticise: tuple[types.Type, ...]

    @classmethod
    def of_width(cls, width: int) -> Signatures:
        """Types of the arguments for `width` lanes."""
        row, matrix = BlockType(1, width), BlockType(2, width)
        params = NumbersType(float64)
        dynamics = (row, row, float64, params)
        term = (float64, row, row, NumbersType(int64), params)
        return cls(
            (*dynamics, row), (*dynamics, matrix, matrix), term, (*term, matrix, row, matrix, row)
        )


def kernel(function: Any) -> Any:
    """Compile a kernel, with Numba's disk cache."""
    return njit(function, cache=True, error_model="numpy")


class GameKernels(NamedTuple):
    """Everything compiled code needs to know of a game, as tables.

    An offset table tells where each item's part of a longer array begins and the previous one's
    ends: player i owns the states `state_offset[i]:state_offset[i + 1]` of the joint state, and
    the terms `term_offset[i]:term_offset[i + 1]`; term j owns a part of `term_index` and one of
    `term_params`. The blocks A, B and R of player i are stored at `A_offset[i]`, `B_offset[i]` and
    `R_offset[i]`, one row after the other. Each row of `A_items` tells where an item of A that may
    differ from 0 is stored, and its row in the joint matrix. They are sorted by column: those of
    column c are `A_items[A_columns[c]:A_columns[c + 1]]`. Likewise for B.
    """

    dt: float
    state_offset: Array
    input_offset: Array
    step: Array
    linearise: Array
    dynamics_params_offset: Array
    dynamics_params: Array
    A_offset: Array
    B_offset: Array
    R_offset: Array
    A_items: Array
    A_columns: Array
    B_items: Array
    B_columns: Array
    term_offset: Array
    cost: Array
    quadraticise: Array
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
    signatures, lanes, none = Signatures.of_width(width), LanesType(width), types.none
    flat = [term for of_player in terms for term in of_player]
    return GameKernels(
        dt,
        _offsets([d.n_states for d in dynamics]),
        _offsets([d.n_inputs for d in dynamics]),
        addresses([type(d).step_kernel for d in dynamics], none, signatures.step),
        addresses([type(d).linearise_kernel for d in dynamics], none, signatures.linearise),
        _offsets([len(d.params) for d in dynamics]),
        _flat([d.params for d in dynamics], float),
        _offsets([d.n_states**2 for d in dynamics]),
        _offsets([d.n_states * d.n_inputs for d in dynamics]),
        _offsets([d.n_inputs**2 for d in dynamics]),
        *_items(dynamics),
        _offsets([len(of_player) for of_player in terms]),
        addresses([type(t.term).cost_kernel for t in flat], lanes, signatures.cost),
        addresses([type(t.term).quadraticise_kernel for t in flat], none, signatures.quadraticise),
        _offsets([len(t.index) for t in flat]),
        _flat([t.index for t in flat], np.int64),
        _offsets([len(t.params) for t in flat]),
        _flat([t.params for t in flat], float),
    )


def written_items(dynamics: Dynamics) -> tuple[np.ndarray, np.ndarray]:
    """Which items of A (n, n) and B (n, m) the kernel `linearise` writes, as truth values."""
    n, m = dynamics.n_states, dynamics.n_inputs
    written = np.zeros((n, n), dtype=bool), np.zeros((n, m), dtype=bool)
    rng = np.random.default_rng(0)
    for untouched in (np.nan, 0.0):  # what is added to nan stays so, but differs from 0
        for scale in (0.0, 1.0, 10.0):
            x, u = scale * rng.normal(size=n), scale * rng.normal(size=m)
            A, B = np.full((n, n), untouched), np.full((n, m), untouched)
            params = np.array(dynamics.params, dtype=float)
            with np.errstate(all="ignore"):  # it may not be made for such states
                type(dynamics).linearise_kernel.py_func(x, u, 0.1, params, A, B)
            for was_written, now in zip(written, (A, B), strict=True):
                was_written |= ~np.isnan(now) if np.isnan(untouched) else now != 0.0
    return written


def _items(dynamics: Sequence[Dynamics]) -> tuple[Array, Array, Array, Array]:
    """The tables `A_items`, `A_columns`, `B_items` and `B_columns`."""
    tables: list[Array] = []
    for matrix in (0, 1):
        items: list[tuple[int, int]] = []
        columns = [0]
        stored = row = 0
        for d in dynamics:
            written = written_items(d)[matrix]
            for c in range(written.shape[1]):
                for s in np.flatnonzero(written[:, c]).tolist():
                    items.append((stored + s * written.shape[1] + c, row + s))
                columns.append(len(items))
            stored, row = stored + written.size, row + d.n_states
        tables += [np.array(items, np.int64).reshape(-1, 2), np.array(columns, np.int64)]
    return tables[0], tables[1], tables[2], tables[3]


def _offsets(lengths: Sequence[int]) -> Array:
    return np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)


def _flat(rows: Sequence[Sequence[float]], dtype: Any) -> Array:
    return np.array([value for row in rows for value in row], dtype=dtype)
