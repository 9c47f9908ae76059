"""The affine strategy of one player along the horizon: a labelled std_msgs/Float64MultiArray.

Each row of the table is a step: u_ref (m), P (m times nx, in row-major order) and x_ref (nx) of the
strategy u = u_ref - P (x - x_ref). The stamp of the first step and the number of the particle
precede the table.
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
    """The contents of a strategy message, for a horizon of T steps.

    Attributes:
        stamp: stamp of the first step, in ns.
        particle: number of the particle; -1 if the strategy only brakes.
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
    """Convert a strategy to a message."""
    T, m, nx = strategy.P.shape
    table = np.hstack([strategy.u_ref, strategy.P.reshape(T, m * nx), strategy.x_ref])
    return multi_array.encode(strategy.stamp, [strategy.particle], table, _labels(m, nx))


def decode(message: Float64MultiArray, m: int, nx: int) -> AffineStrategy:
    """Convert a message to a strategy of a player with `m` inputs in a game with `nx` states.

    Raises:
        MessageError: the layout does not match, there are no steps, the particle is not a whole
            number, or a number is not finite.
    """
    time, prefix, table = multi_array.decode(message, 1, _labels(m, nx), m + m * nx + nx)
    check_finite("data", table)
    check_whole("particle", prefix, lowest=-1)
    u_ref, P, x_ref = np.split(table, [m, m + m * nx], axis=1)
    return AffineStrategy(time, int(prefix[0]), u_ref, P.reshape(-1, m, nx), x_ref)


def _labels(m: int, nx: int) -> tuple[str, str]:
    return "step", f"u_ref[{m}] P[{m}x{nx}] x_ref[{nx}]"
