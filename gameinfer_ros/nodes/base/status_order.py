"""Which statuses of nodes are about the present run."""

from __future__ import annotations

from gameinfer_ros.nodes.base.step_order import AHEAD
from msg_adapters import MessageError, diagnostics

#: So many nodes are known.
MOST_NODES = 100


class StatusOrder:
    """Admits what nodes say of themselves, but nothing about a run that is over.

    When a run begins anew, a node may still be busy with a late step of the run before, so that no
    clock tells which of the two its status is about. But what one node says comes in order. So it
    is taken to be in the run before until its steps go back, or the new run has come that far.

    Attributes:
        late: number of statuses that were about a run that is over.
    """

    def __init__(self) -> None:
        self.late = 0
        self._first_run = True
        self._told: dict[str, int] = {}
        self._present: set[str] = set()
        self._ahead: set[str] = set()

    def begin(self) -> None:
        """A new run has begun."""
        self._first_run = False
        self._present, self._ahead = self._ahead, set()  # a status may come before its state

    def admits(self, status: diagnostics.NodeStatus, newest: int) -> bool:
        """Whether a status is about the present run, whose newest state is that of this step.

        Raises:
            MessageError: its step is no number, or far ahead of the newest state, or too many
                nodes are known.
        """
        name, step = status.name, diagnostics.whole_number(status, "step")
        if name not in self._told and len(self._told) == MOST_NODES:
            raise MessageError(
                f"status.name: '{name}' is not allowed: {MOST_NODES} nodes are known"
            )
        if step is None:
            self._told.setdefault(name, -1)
            return True
        goes_back = step < self._told.get(name, step)
        if not (self._first_run or name in self._present or goes_back or step <= newest):
            self._told[name] = step
            self.late += 1
            return False
        if step > newest + AHEAD:
            raise MessageError(
                f"{name}: step: {step} is not allowed: the newest state is that of step {newest}, "
                f"and at most {AHEAD} later ones are believed"
            )
        if goes_back and name in self._present:
            self._ahead.add(name)
        self._present.add(name)
        self._told[name] = step
        return True
