"""Angles modulo a turn."""

from __future__ import annotations

from typing import Any

import numpy as np

from gameinfer_ros.games.kernels import kernel

#: A turn, in rad.
TURN = 2 * np.pi


@kernel
def short_way(difference: Any) -> Any:
    """Return the difference of two angles, in rad, without whole turns: from -pi to pi.

    It takes numbers and NumPy arrays, also in kernels. Exactly half a turn keeps its sign, so that
    neither way is preferred.
    """
    return difference - TURN * np.rint(difference * (1.0 / TURN))


@kernel
def difference(one: Any, other: Any, is_angle: float) -> Any:
    """Return one - other; of angles, by the short way."""
    plain = one - other
    if is_angle:
        plain = short_way(plain)
    return plain
