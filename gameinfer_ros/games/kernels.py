"""The signatures of kernels, and the tables of kernels that make up a game.

Kernels are small functions of dynamics and cost terms for *one step* of the horizon. They are
written for one particle. The compiler makes them process several particles at once, one in each
lane (see `gameinfer_ros.lanes.lanes`).

| symbol | shape | meaning |
|---|---|---|
| n, m | | number of states and inputs of one player |
| nx | | number of states of all players |
| t | scalar | time of the step since the start of the run, in s |
| x | (n,) or (nx,) | state of one player (dynamics) or of all players in order (cost terms) |
| u | (m,) | input of the player |
| index | (...,) | integers that the term is bound to, such as rows of x |
| params | (...,) | numbers of the dynamics or the term, such as weights |

There are four kinds of kernels:

- `step(x, u, dt, params, x_next)` writes the state (n,) one step of `dt` seconds later.
- `linearise(x, u, dt, params, A, B)` writes the elements of A (n, n) and B (n, m) in
  x_next = A x + B u that can differ from 0. It must always write the same ones. The others are 0
  already, and the solver skips them.
- `cost(t, x, u, index, params)` returns the cost of the term at this step.
- `quadraticise(t, x, u, index, params, Q, q, R, r)` adds the second and first derivatives of the
  term by x to Q (nx, nx) and q (nx,), and those by u to R (m, m) and r (m,).

When called from Python, a kernel takes NumPy arrays, which may have the particle as an additional
last axis.

Compiled code calls kernels by address. It therefore does not depend on the players and terms of a
game, and is compiled once for all games.
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
    """Numba types of the arguments of kernels, for one number of lanes."""

    step: tuple[types.Type, ...]
    linearise: tuple[types.Type, ...]
    cost: tuple[types.Type, ...]
    quadraticise: tuple[types.Type, ...]

    @classmethod
    def of_width(cls, width: int) -> Signatures:
        """Create the signatures for `width` lanes."""
        row, matrix = BlockType(1, width), BlockType(2, width)
        params = NumbersType(float64)
        dynamics = (row, row, float64, params)
        term = (float64, row, row, NumbersType(int64), params)
        return cls(
            (*dynamics, row), (*dynamics, matrix, matrix), term, (*term, matrix, row, matrix, row)
        )


def kernel(function: Any) -> Any:
    """Compile a kernel and keep it in Numba's disk cache; a decorator."""
    return njit(function, cache=True, error_model="numpy")


class GameKernels(NamedTuple):
    """A game as tables for compiled code.

    The arrays that end in `_offset` contain the start of each item's part in a longer array. For
    example, player i has the states `state_offset[i]:state_offset[i + 1]` of the joint state and
    the terms `term_offset[i]:term_offset[i + 1]`. Term j has a part of `term_index` and a part of
    `term_params`. The blocks A, B and R of player i start at `A_offset[i]`, `B_offset[i]` and
    `R_offset[i]` and are stored row by row.

    Each row of `A_items` belongs to an element of A that can differ from 0. It contains the place
    where the element is stored, and its row in the joint matrix. The rows are sorted by column:
    those of column c are `A_items[A_columns[c]:A_columns[c + 1]]`. The same applies to B.
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
    """Create the tables of a game, and compile the kernels that the disk cache does not contain.

    Args:
        dt: length of a time step, in s.
        dynamics: dynamics of each player.
        terms: cost terms of each player.
        width: number of lanes.
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
    """Return which elements of A (n, n) and B (n, m) the kernel `linearise` writes, as booleans."""
    n, m = dynamics.n_states, dynamics.n_inputs
    written = np.zeros((n, n), dtype=bool), np.zeros((n, m), dtype=bool)
    rng = np.random.default_rng(0)
    for untouched in (np.nan, 0.0):  # an element that is added to stays nan, but not 0
        for scale in (0.0, 1.0, 10.0):
            x, u = scale * rng.normal(size=n), scale * rng.normal(size=m)
            A, B = np.full((n, n), untouched), np.full((n, m), untouched)
            params = np.array(dynamics.params, dtype=float)
            with np.errstate(all="ignore"):  # the kernel may overflow at arbitrary states
                type(dynamics).linearise_kernel.py_func(x, u, 0.1, params, A, B)
            for was_written, now in zip(written, (A, B), strict=True):
                was_written |= ~np.isnan(now) if np.isnan(untouched) else now != 0.0
    return written


def _items(dynamics: Sequence[Dynamics]) -> tuple[Array, Array, Array, Array]:
    """Create the tables `A_items`, `A_columns`, `B_items` and `B_columns`."""
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
