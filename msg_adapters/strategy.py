"""One player's affine strategy along the horizon: a labelled std_msgs/Float64MultiArray.

A row is a step and holds u_ref (m), P (m times nx, row after row) and x_ref (nx) of the strategy
u = u_ref - P (x - x_ref). Before the table stand the stamp of the first step and the particle that
the strategy belongs to.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import multi_array
from msg_adapters.error import check_finite, check_whole

if TYPE_CHECKING:
    from std_msgs.msg import Float64MultiArray


@dataclass(frozen=True)
class AffineStrategy:
    """What a strategy message says, for a horizon of T steps.

    Attributes:
        stamp: time of the step that the horizon starts at, in ns.
        particle: number of the particle; -1 if all brake.
        u_ref: reference inputs of the player (T, m).
        P: gains (T, m, nx).
        x_ref: reference joint states (T, nx).
    """

    stamp: int
    particle: int
    u_ref: np.ndarray
    P: np.ndarray
    x_ref: np.ndarray


def encode(strategy: AffineStrategy) -> Float64MultiArray:
    """Message with a strategy."""
    T, m, nx = strategy.P.shape
    table = np.hstack([strategy.u_ref, strategy.P.reshape(T, m * nx), strategy.x_ref])
    return multi_array.encode(strategy.stamp, [strategy.particle], table, _labels(m, nx))


def decode(message: Float64MultiArray, m: int, nx: int) -> AffineStrategy:
    """What a message says about a player with m inputs in a game with nx joint states.

    Raises:
        MessageError: the layout is another, there is no step, the particle is not a whole
            number, or a number is not finite.
    """
    time, prefix, table = multi_array.decode(message, 1, _labels(m, nx), m + m * nx + nx)
    check_finite("data", table)
    check_whole("particle", prefix, lowest=-1)
    u_ref, P, x_ref = np.split(table, [m, m + m * nx], axis=1)
    return AffineStrategy(time, int(prefix[0]), u_ref, P.reshape(-1, m, nx), x_ref)


def _labels(m: int, nx: int) -> tuple[str, str]:
    return "step", f"u_ref[{m}] P[{m}x{nx}] x_ref[{nx}]"
