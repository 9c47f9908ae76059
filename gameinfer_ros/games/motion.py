"""The motion of a single vehicle that applies inputs and then brakes."""

from typing import NamedTuple

import numpy as np

from gameinfer_ros.games.dynamics.dynamics import Vehicle


class MovingPoints(NamedTuple):
    """Points that move straight ahead at constant speed.

    Attributes:
        positions: positions (J, 2) at step 0, in m.
        velocities: velocities (J, 2), in m/s.
    """

    positions: np.ndarray
    velocities: np.ndarray


class Motion:
    """The motion of a single vehicle that applies inputs and then brakes within its limits.

    Several starts are simulated at once, as K particles.

    Args:
        vehicle: the vehicle.
        dt: length of a time step, in s.
        low: lowest input (m,) when it brakes.
        high: highest input (m,) when it brakes.
    """

    def __init__(self, vehicle: Vehicle, dt: float, low: np.ndarray, high: np.ndarray) -> None:
        self._vehicle, self._dt = vehicle, dt
        params = np.array(vehicle.params, dtype=float)
        self._constants = dt, np.array([0, len(params)]), params, low, high
        self._position = np.array(vehicle.position)

    def states(self, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        """Simulate the vehicle.

        Args:
            s: state (n,) at the start, or (n, K) of K particles.
            w: inputs (S, m) or (S, m, K) of the first S steps. In later steps, it brakes.
            steps: number of steps T.

        Returns:
            States (T + 1, n) or (T + 1, n, K).
        """
        from gameinfer_ros.lanes.blocks import from_blocks

        if s.ndim == 1:
            return self._simulated(s[:, None], w[..., None], steps)[0, ..., 0]
        return from_blocks(self._simulated(s, w, steps), s.shape[-1])

    def distances(
        self, s: np.ndarray, w: np.ndarray, steps: int, others: MovingPoints, start: np.ndarray
    ) -> np.ndarray:
        """Return the smallest distances to moving points during each step of the motion.

        Positions are interpolated linearly within a step.

        Args:
            s: states (n, K) of K particles at their start.
            w: inputs (S, m, K) of the first S steps. In later steps, the vehicle brakes.
            steps: number of steps T.
            others: J moving points.
            start: step (K,) at which each particle starts.

        Returns:
            Distances (T, J, K) in m.
        """
        from gameinfer_ros.games import compiled_motion
        from gameinfer_ros.lanes.blocks import from_blocks, in_blocks

        states = self._simulated(s, w, steps)
        start_blocks = in_blocks(start)
        out = np.empty((len(states), steps, len(others.positions), states.shape[-1]))
        lanes = (None,) * states.shape[-1]
        compiled_motion.distances(
            lanes, self._dt, self._position, *others, start_blocks, states, out
        )
        return from_blocks(out, s.shape[-1])

    def _simulated(self, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        """Simulate particles (n, K); return blocks (blocks, T + 1, n, width)."""
        from gameinfer_ros.games import compiled_motion
        from gameinfer_ros.lanes.blocks import in_blocks

        first, given = in_blocks(s), in_blocks(w[:steps])
        blocks, n, width = first.shape
        states = np.empty((blocks, steps + 1, n, width))
        states[:, 0] = first
        inputs = np.zeros((blocks, steps, self._vehicle.n_inputs, width))
        inputs[:, : given.shape[1]] = given
        kernels = compiled_motion.kernels(type(self._vehicle), width)
        compiled_motion.simulate(
            (None,) * width, *kernels, *self._constants, given.shape[1], inputs, states
        )
        return states
