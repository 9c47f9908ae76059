"""Headings as unit quaternions, which is how poses carry them."""

from __future__ import annotations

import numpy as np


def quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Unit quaternion (x, y, z, w) of a rotation by `yaw`, in rad, about the vertical axis."""
    return 0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))


def yaw(x: float, y: float, z: float, w: float) -> float:
    """Yaw of the rotation by a unit quaternion, in rad, in (-pi, pi]."""
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
