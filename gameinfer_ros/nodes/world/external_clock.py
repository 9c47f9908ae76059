"""The clock of external players, which may stop, jump ahead or be set back."""

from time import monotonic

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.world.world import World
from gameinfer_ros.runs.record import MOST_MISSING

#: Largest number of overdue steps that are simulated. With more, the clock has jumped and the steps
#: are skipped.
_MADE_UP = 20

#: Largest number of skipped states of a run. A record allows some more, because it also lacks the
#: states that get lost.
MOST_LEFT_OUT = MOST_MISSING * 9 // 10


class ClockError(RuntimeError):
    """The run cannot continue after a change of the clock. The message says why."""


class ExternalClock:
    """Tells which steps of a run that began at `start`, in ns, are due on the node's clock."""

    def __init__(self, node: GameNode, start: int) -> None:
        self._node, self._start = node, 1e-9 * start
        self._newest, self._read = node.now, monotonic()

    def stopped(self, seconds: float) -> bool:
        """Whether `due` has not been called for some seconds, as its timer uses the clock."""
        return monotonic() - self._read > seconds

    def due(self, world: World) -> int:
        """The step that is due. If too many steps are overdue, the world skips those before it.

        Raises:
            ClockError: the clock was set back, or the run would lack too many states.
        """
        now, self._read = self._node.now, monotonic()
        if now < self._newest:
            raise ClockError("the clock was set back")
        self._newest = now
        # A timer may be a little early.
        step = int((1e-9 * now - self._start) / self._node.game.dt + 0.1)
        missing = world.unpublished + step - world.published - 1
        if missing > MOST_LEFT_OUT:
            raise ClockError(
                f"{missing} states are missing, but at most {MOST_LEFT_OUT} are allowed"
            )
        if step > world.step + _MADE_UP:
            self._node.get_logger().warn(
                f"the clock jumped ahead: steps {world.step + 1} to {step - 1} are skipped"
            )
            world.step = step - 1
        return step
