"""Compiled evaluation of a game: its costs and its steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.lanes.addresses import call, call_for_lanes
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import block, from_blocks, rows
from gameinfer_ros.lanes.blocks import in_blocks as split
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.numbers import part


def in_blocks(
    kernels: Callable[[int], GameKernels],
    function: Any,
    shape: tuple[int, ...],
    x: np.ndarray,
    u: np.ndarray,
    *others: int,
) -> np.ndarray:
    """Return what a compiled function adds to zeros (*shape) or (*shape, K)."""
    single = x.ndim == len(shape)
    x_blocks, u_blocks = (split(a[..., None] if single else a) for a in (x, u))
    width = x_blocks.shape[-1]
    out = np.zeros((len(x_blocks), *shape, width))
    for b in range(len(out)):
        function(kernels(width), x_blocks[b], u_blocks[b], *others, out[b])
    return from_blocks(out, 1)[..., 0] if single else from_blocks(out, x.shape[-1])


@njit(error_model="numpy")
def costs(game: GameKernels, x: Array, u: Array, first_step: int, out: Array) -> None:
    """Add the costs (N, S, W) of a block of trajectories to `out`."""
    x, u, out = block(x, game.lanes), block(u, game.lanes), block(out, game.lanes)
    for k in range(len(x)):
        t = (first_step + k) * game.dt
        for i in range(len(out)):
            own = rows(u[k], game.input_offset[i], game.input_offset[i + 1])
            for j in range(game.term_offset[i], game.term_offset[i + 1]):
                index = part(game.term_index, game.term_index_offset, j)
                params = part(game.term_params, game.term_params_offset, j)
                out[i, k] += call_for_lanes(game.cost[j], (t, x[k], own, index, params))


@njit(error_model="numpy")
def step(game: GameKernels, x: Array, u: Array, x_next: Array) -> None:
    """Add the states (nx, W) one step later to `x_next`."""
    x, u, x_next = block(x, game.lanes), block(u, game.lanes), block(x_next, game.lanes)
    for i in range(len(game.step)):
        first, last = game.state_offset[i], game.state_offset[i + 1]
        own = rows(u, game.input_offset[i], game.input_offset[i + 1])
        params = part(game.dynamics_params, game.dynamics_params_offset, i)
        x_i, x_next_i = rows(x, first, last), rows(x_next, first, last)
        call(game.step[i], (x_i, own, game.dt, params, x_next_i))
