"""Simulated players."""

from time import perf_counter

import numpy as np

from gameinfer_ros.games import Vehicles
from msg_adapters import MessageError
from msg_adapters.control import Control


class SimulatedPlayer:
    """A player whose vehicle is simulated: its last plan, and how late its inputs are.

    Attributes:
        late_steps: number of steps whose input was late, as counted by `World`.
        latency_ms: time between the state of the present step and the input for it, in ms; None if
            the input has not arrived.
    """

    def __init__(self, vehicles: Vehicles, i: int) -> None:
        self._vehicles, self._i = vehicles, i
        self._plan: Control | None = None
        self._first = -1  # step of the first input of the plan
        self.late_steps = 0
        self.latency_ms: float | None = None

    def receive(self, first: int, plan: Control, step: int, published: float) -> None:
        """Store a plan from the step `first` on.

        `published` is when the state of the present `step` was published, by `time.perf_counter`.

        Raises:
            MessageError: the plan is for a future step, or older than the last one.
        """
        if first > step:
            raise MessageError(f"stamp: step {first} is not allowed: the present step is {step}")
        if first < self._first:
            raise MessageError(
                f"stamp: step {first} is stale: step {self._first} has been received"
            )
        self._first, self._plan = first, plan
        if first == step:
            self.latency_ms = 1e3 * (perf_counter() - published)

    def is_ready(self, step: int) -> bool:
        """Whether the input for a step has arrived."""
        return self._first == step

    def input(self, step: int, s: np.ndarray) -> np.ndarray:
        """Input (m,) for a step in the state `s` (n,): that of the last plan, then braking."""
        if not self.is_ready(step):
            self.latency_ms = None
        if self._plan is not None:
            k = step - self._first
            if k < len(self._plan.twists):
                vehicle = self._vehicles.dynamics[self._i]
                return vehicle.input(self._plan.twists[k], self._plan.accelerations[k])
        return self._vehicles.braking_input(self._i, s)
