"""Points that move."""

from typing import NamedTuple

import numpy as np


class MovingPoints(NamedTuple):
    """Points that move straight ahead at constant speed.

    Attributes:
        positions: positions (J, 2) at step 0, in m.
        velocities: velocities (J, 2), in m/s.
    """

    positions: np.ndarray
    velocities: np.ndarray
