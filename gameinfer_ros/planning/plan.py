"""A plan: the next few inputs."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.solver import Strategy

#: So many inputs has a plan unless somebody wants another number.
PLAN_LENGTH = 10


def plan(strategy: Strategy, step: int, x: np.ndarray, length: int) -> np.ndarray:
    """The inputs that a strategy gives from `step` on.

    The first is the strategy's reaction to the state `x`; the others are what it expects to do
    later, should no newer state arrive.

    Args:
        strategy: strategy of one particle, for m inputs.
        step: the step that `x` belongs to; it must be in the horizon of `strategy`.
        x: joint state (nx,).
        length: number of inputs wanted.

    Returns:
        Inputs (S, m), with S = `length` or fewer where the horizon ends before.

    Raises:
        IndexError: the horizon does not contain `step`.
    """
    first = strategy.inputs(step, x)[:, 0]
    k = step - strategy.first_step
    return np.vstack([first, strategy.u_ref[k + 1 : k + length, :, 0]])
