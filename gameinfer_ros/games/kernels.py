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

There are these kinds of kernels:

- `step(x, u, dt, params, x_next)` writes the state (n,) one step of `dt` seconds later. Newton's
  method also differentiates it (see `gameinfer_ros.games.derivatives`).
- `linearise(x, u, dt, params, A, B)` writes the elements of A (n, n) and B (n, m) in
  x_next = A x + B u that can differ from 0. It must always write the same ones. The others are 0
  already, and the solver skips them. Dynamics may leave it out: the solver then differentiates
  `step`.
- `brake(x, dt, params, u)` writes the input (m,) that brings a vehicle to rest in `dt` seconds. The
  other dynamics have none.
- `cost(t, x, u, index, params)` returns the cost of the term at this step.
- `quadraticise(t, x, u, index, params, Q, q, R, r)` adds the second and first derivatives of the
  term by x to Q (nx, nx) and q (nx,), and those by u to R (m, m) and r (m,).
- `gauss_newton`, with the same arguments, adds second derivatives that are positive semidefinite.
  Terms whose second derivatives always are have none.

When called from Python, a kernel takes NumPy arrays, which may have the particle as an additional
last axis.

Compiled code calls kernels by address. It therefore does not depend on the players and terms of a
game, and is compiled once for all games.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gameinfer_ros.lanes.array import Array


class Kernel:
    """A function that is compiled when a game needs it; until then, Numba is not imported.

    A call from Python runs the function itself. Compiled code may call it too.
    """

    def __init__(self, function: Any) -> None:
        self.py_func = self.__wrapped__ = function
        self.__doc__, self.__name__ = function.__doc__, function.__name__

    def __call__(self, *args: Any) -> Any:
        """Call the function itself; as in compiled code, nothing warns of numbers that overflow."""
        with np.errstate(all="ignore"):
            return self.py_func(*args)

    @cached_property
    def compiled(self) -> Any:
        """The function as compiled by Numba, which keeps it in its disk cache."""
        from gameinfer_ros.lanes.compile_cache import njit

        return njit(self.py_func, error_model="numpy")

    @property
    def _numba_type_(self) -> Any:  # Numba looks for this name
        from numba import types

        return types.Dispatcher(self.compiled)


#: Decorator that makes a function a kernel.
kernel = Kernel


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
    linearise: Array  # called with the address in `linearised` first
    linearised: Array
    curve: Array  # called with the address in `curved` first; 0 if there are no second derivatives
    curved: Array
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
    gauss_newton: Array
    term_index_offset: Array
    term_index: Array
    term_params_offset: Array
    term_params: Array
