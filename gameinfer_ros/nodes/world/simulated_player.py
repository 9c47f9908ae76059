"""A player whose vehicle is simulated."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from gameinfer_ros.games import Vehicles
from msg_adapters import MessageError
from msg_adapters.control import Control


class SimulatedPlayer:
    """What a player wants to do, and how late it is with that.

    Args:
        vehicles: what all players are.
        i: index of the player.

    Attributes:
        late_steps: number of steps whose input came too late, as others count them.
        latency_ms: how long after the state of the present step the input for it came; None if it
            has not come.
    """

    def __init__(self, vehicles: Vehicles, i: int) -> None:
        self._vehicles, self._i = vehicles, i
        self._plan: Control | None = None
        self._first = -1  # step of its first input
        self.late_steps = 0
        self.latency_ms: float | None = None

    def receive(self, first: int, plan: Control, step: int, published: float) -> None:
        """Take in a plan from a step on, while `step` is the present one.

        Args:
            first: the step that its first input is for.
            plan: the plan.
            step: the present step.
            published: when the state of that was published, by `perf_counter`.

        Raises:
            MessageError: it is of the future, or older than the last one.
        """
        if first > step:
            raise MessageError(f"stamp: step {first} is not allowed: the simulation is at {step}")
        if first < self._first:
            raise MessageError(
                f"stamp: step {first} is stale: step {self._first} has been received"
            )
        self._first, self._plan = first, plan
        if first == step:
            self.latency_ms = 1e3 * (perf_counter() - published)

    def is_ready(self, step: int) -> bool:
        """Whether the input for this step has come."""
        return self._first == step

    def input(self, step: int, s: np.ndarray) -> np.ndarray:
        """Input (m,) in the state `s` (n,): that of the last plan, or the brake if it has ended."""
        if not self.is_ready(step):
            self.latency_ms = None
        if self._plan is not None:
            k = step - self._first
            if k < len(self._plan.twists):
                vehicle = self._vehicles.dynamics[self._i]
                return vehicle.input(self._plan.twists[k], self._plan.accelerations[k])
        return self._vehicles.braking_input(self._i, s)
