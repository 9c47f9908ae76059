"""Bounds on the age of the data that the robot acts on."""

from collections.abc import Callable
from time import monotonic


class Freshness:
    """Limits on the age of the state and of the strategy that the robot acts on.

    All times are in s, by `time.monotonic`. The time of a state is that of its publication. The
    time of a strategy is that of the state it was computed from.

    Args:
        dt: length of a time step, in s.
        state_age: returns the largest age of the state; 0 for 0.5 s or five time steps, whichever
            is longer.
        strategy_age: returns the largest age of the strategy; 0 for 1 s or ten time steps,
            whichever is longer.
    """

    def __init__(
        self, dt: float, state_age: Callable[[], float], strategy_age: Callable[[], float]
    ) -> None:
        self._dt, self._state_age, self._strategy_age = dt, state_age, strategy_age

    @property
    def _limits(self) -> tuple[float, float]:
        """Largest age of the state and of the strategy."""
        dt = self._dt
        return self._state_age() or max(0.5, 5 * dt), self._strategy_age() or max(1.0, 10 * dt)

    def complaint(self, state_time: float, strategy_time: float, missing: str) -> str:
        """What is too old now, in words; empty if nothing is.

        `missing` says what has not arrived if the state is too old.
        """
        state_age, strategy_age = monotonic() - state_time, monotonic() - strategy_time
        max_state_age, max_strategy_age = self._limits
        if state_age > max_state_age:
            return f"no {missing} for {state_age:.1f} s"
        if strategy_age > max_strategy_age:
            return f"the newest strategy is {strategy_age:.1f} s old"
        return ""

    def inputs(self, state_time: float, strategy_time: float) -> int:
        """Number of inputs, one a step and at least 1, that can start before data is too old."""
        max_state_age, max_strategy_age = self._limits
        left = min(state_time + max_state_age, strategy_time + max_strategy_age) - monotonic()
        return 1 + max(0, int(left / self._dt + 1e-9))
