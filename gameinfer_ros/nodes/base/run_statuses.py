"""Which statuses of nodes count for those who watch a run."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray

from gameinfer_ros.runs.run_clock import RunClock
from msg_adapters import MessageError, diagnostics

#: At most this many nodes are known.
MOST_NODES = 100


class RunStatuses:
    """Picks the statuses of the nodes in one namespace, but none of an earlier run.

    A status about a step names its run by the value `run`. The others are about the node, whatever
    the run.

    Args:
        namespace: of the nodes; the topic is that of all robots.
        clock: tells which run is the present one.
    """

    def __init__(self, namespace: str, clock: RunClock) -> None:
        self._prefix, self._clock = namespace.rstrip("/") + "/", clock
        self._names: set[str] = set()

    def of(self, message: DiagnosticArray) -> list[diagnostics.NodeStatus]:
        """The statuses in a message that count.

        Raises:
            EarlyError: one is of a run that is not known yet.
            MessageError: one is malformed, or too many nodes are known.
        """
        found = []
        for status in diagnostics.decode(message):
            if status.name.rpartition("/")[0] + "/" != self._prefix:
                continue
            if "step" in status.values and not self._is_present(status):
                continue
            if status.name not in self._names and len(self._names) == MOST_NODES:
                raise MessageError(
                    f"status.name: '{status.name}' is not allowed: {MOST_NODES} nodes are known"
                )
            self._names.add(status.name)
            found.append(status)
        return found

    def _is_present(self, status: diagnostics.NodeStatus) -> bool:
        if "run" not in status.values:
            raise MessageError(f"{status.name}: run: is missing: it must name the run of the step")
        return self._clock.is_present(status.values["run"])
