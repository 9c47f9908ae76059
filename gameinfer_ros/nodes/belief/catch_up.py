"""Time limits of an inference node that joins a run late."""

from collections.abc import Callable
from time import perf_counter

from rclpy.timer import Timer

from gameinfer_ros.nodes.base.game_node import GameNode

#: After the first solve, in time steps: limit on solving earlier states, and on catching up.
SOLVE_STEPS, PUBLISH_STEPS = 5, 8


class CatchUp:
    """Decides when a node that joins a run late has caught up.

    The earlier states of the run arrive in quick succession, and each makes the previous one
    outdated. The node therefore publishes nothing until no more states arrive, or until a time
    limit. In lockstep, the node solves and publishes every state, and this class does nothing.

    `on_quiet` is called when no state has arrived for a quarter of a time step, until `end`.
    """

    def __init__(self, node: GameNode, on_quiet: Callable[[], None]) -> None:
        self._node, self._on_quiet = node, on_quiet
        self._dt = node.game.dt
        self._started: float | None = None
        self._arrived = False  # whether a state has arrived since the last check
        self._timer: Timer | None = None
        if not node.lockstep:
            self._timer = node.every(0.25 * self._dt, self._check)

    @property
    def active(self) -> bool:
        """Whether the node is still catching up."""
        return self._timer is not None

    @property
    def deadline(self) -> float:
        """Time until which earlier states may be solved, by `time.perf_counter`, in s."""
        assert self._started is not None
        return self._started + SOLVE_STEPS * self._dt

    def covers(self, now: float) -> bool:
        """Whether the state handled at `now`, by `perf_counter`, is an earlier one; ends if not."""
        self._started = self._started or now
        if self.active and now < self._started + PUBLISH_STEPS * self._dt:
            self._arrived = True
            return True
        self.end()
        return False

    def restart(self) -> None:
        """Start the time limits again: the first solve does not count."""
        self._started = perf_counter()

    def end(self) -> None:
        """Stop catching up, and destroy the timer."""
        if self._timer is not None:
            self._timer.cancel()
            self._node.destroy_timer(self._timer)
            self._timer = None

    def _check(self) -> None:
        arrived, self._arrived = self._arrived, False
        if not arrived:
            self._on_quiet()
