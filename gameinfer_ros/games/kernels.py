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
from numba import float64, int64, types

from gameinfer_ros.lanes.addresses import addresses
from gameinfer_ros.lanes.blocks import BlockType
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.lanes import Array, LanesType
from gameinfer_ros.lanes.numbers import NumbersType

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gameinfer_ros.games.costs.cost_term import BoundTerm
    from gameinfer_ros.games.dynamics.dynamics import Dynamics


def kernel(function: Any) -> Any:
    """Compile a kernel and keep it in Numba's disk cache; a decorator."""
    return njit(function, error_model="numpy")


class GameKernels(NamedTuple):
    """A game as tables for compiled code.

    The arrays that end in `_offset` contain the start of each item's part in a longer array. For
    example, player i has the states `state_offset[i]:state_offset[i + 1]` of the joint state and
    the terms `term_offset[i]:term_offset[i + 1]`. Term j has a part of `term_index` and a part of
    `term_params`. The blocks A and B of player i start at `A_offset[i]` and `B_offset[i]` and are
    stored row by row.

    Each row of `A_items` belongs to an element of A that can differ from 0. It contains the place
    where the element is stored, and its row in the joint matrix. The rows are sorted by column:
    those of column c are `A_items[A_columns[c]:A_columns[c + 1]]`. The same applies to B.

    `lanes` has one item for each lane: compiled code knows their number from its type.
    """

    lanes: tuple[None, ...]
    dt: float
    state_offset: Array
    input_offset: Array
    step: Array
    linearise: Array
    dynamics_params_offset: Array
    dynamics_params: Array
    A_offset: Array
    B_offset: Array
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
    row, matrix, params = BlockType(1, width), BlockType(2, width), NumbersType(float64)
    of_dynamics = (row, row, float64, params)
    of_term = (float64, row, row, NumbersType(int64), params)
    derivatives = (matrix, row, matrix, row)
    flat = [term for of_player in terms for term in of_player]
    written = [written_items(d) for d in dynamics]
    return GameKernels(
        (None,) * width,
        dt,
        _offsets([d.n_states for d in dynamics]),
        _offsets([d.n_inputs for d in dynamics]),
        addresses([type(d).step_kernel for d in dynamics], types.none, (*of_dynamics, row)),
        addresses(
            [type(d).linearise_kernel for d in dynamics], types.none, (*of_dynamics, matrix, matrix)
        ),
        _offsets([len(d.params) for d in dynamics]),
        _flat([d.params for d in dynamics], float),
        _offsets([d.n_states**2 for d in dynamics]),
        _offsets([d.n_states * d.n_inputs for d in dynamics]),
        *_items([A for A, _ in written]),
        *_items([B for _, B in written]),
        _offsets([len(of_player) for of_player in terms]),
        addresses([type(t.term).cost_kernel for t in flat], LanesType(width), of_term),
        addresses(
            [type(t.term).quadraticise_kernel for t in flat], types.none, (*of_term, *derivatives)
        ),
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


def _items(written: Sequence[np.ndarray]) -> tuple[Array, Array]:
    """Create the tables `A_items` and `A_columns`, or those of B."""
    items, counts, stored, row = [], [], 0, 0
    for of_player in written:
        c, s = np.nonzero(of_player.T)
        items.append(np.stack([stored + s * of_player.shape[1] + c, row + s], axis=1))
        counts += of_player.sum(axis=0).tolist()
        stored, row = stored + of_player.size, row + len(of_player)
    return np.concatenate(items), _offsets(counts)


def _offsets(lengths: Sequence[int]) -> Array:
    return np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)


def _flat(parts: Sequence[Sequence[float]], dtype: Any) -> Array:
    return np.array([value for values in parts for value in values], dtype=dtype)
