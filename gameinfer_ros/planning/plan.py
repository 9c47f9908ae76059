"""A plan: the inputs of the next few steps."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.solver import Strategy

#: Default number of inputs of a plan.
PLAN_LENGTH = 10


def plan(strategy: Strategy, step: int, x: np.ndarray, length: int) -> np.ndarray:
    """Return the inputs of a strategy from `step` on.

    The first input is the feedback on the state `x`. The others are the reference inputs of the
    following steps, to be applied if no newer state arrives.

    Args:
        strategy: strategy of one particle, for m inputs.
        step: step of `x`; the horizon of `strategy` must contain it.
        x: joint state (nx,).
        length: number of inputs.

    Returns:
        Inputs (S, m), with S = `length`, or fewer if the horizon ends before.

    Raises:
        IndexError: the horizon does not contain `step`.
    """
    first = strategy.inputs(step, x)[:, 0]
    k = step - strategy.first_step
    return np.vstack([first, strategy.u_ref[k + 1 : k + length, :, 0]])
