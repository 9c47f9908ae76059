"""How old may be what a robot reacts to."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic


class Freshness:
    """Bounds the age of the state and of the strategy that a robot follows.

    Times are those of `time.monotonic`; the time of a state is that of its publication, and the
    time of a strategy that of the state that it is of.

    Args:
        dt: length of a time step, in s.
        state_age: tells how old the state may be, in s; 0 for half a second, or five time steps if
            these are longer.
        strategy_age: likewise of the strategy; 0 for a second, or ten time steps.
    """

    def __init__(
        self, dt: float, state_age: Callable[[], float], strategy_age: Callable[[], float]
    ) -> None:
        self._dt, self._state_age, self._strategy_age = dt, state_age, strategy_age

    @property
    def max_state_age(self) -> float:
        """How old the state may be, in s."""
        return self._state_age() or max(0.5, 5 * self._dt)

    @property
    def max_strategy_age(self) -> float:
        """How old the strategy may be, in s."""
        return self._strategy_age() or max(1.0, 10 * self._dt)

    def complaint(self, state_time: float, strategy_time: float, missing: str) -> str:
        """What is too old now, and how old; empty if nothing is.

        Args:
            state_time: of which time the state is.
            strategy_time: of which time the strategy is.
            missing: what would be needed if the state is too old.
        """
        state_age, strategy_age = monotonic() - state_time, monotonic() - strategy_time
        if state_age > self.max_state_age:
            return f"no {missing} for {state_age:.1f} s"
        if strategy_age > self.max_strategy_age:
            return f"the newest strategy is {strategy_age:.1f} s old"
        return ""

    def inputs(self, state_time: float, strategy_time: float) -> int:
        """How many inputs of a plan may begin, one in each step, before something is too old."""
        now = monotonic()
        left = min(
            state_time + self.max_state_age - now, strategy_time + self.max_strategy_age - now
        )
        return 1 + max(0, int(left / self._dt + 1e-9))
