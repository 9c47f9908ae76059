"""Conversion of headings from and to unit quaternions, as in the poses of messages."""

from __future__ import annotations

import numpy as np


def quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Return the unit quaternion (x, y, z, w) of a rotation by `yaw`, in rad, about the z axis."""
    return 0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))


def yaw(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw, in rad in (-pi, pi], of a rotation by a unit quaternion."""
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
