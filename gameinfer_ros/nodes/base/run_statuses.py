"""Selection of the node statuses that belong to a run."""

from diagnostic_msgs.msg import DiagnosticArray

from gameinfer_ros.runs.run_clock import RunClock
from msg_adapters import MessageError, diagnostics

#: Largest number of nodes whose statuses are accepted.
MOST_NODES = 100


class RunStatuses:
    """Selects the statuses of the nodes in one namespace, except those of an earlier run.

    All robots share the topic `/diagnostics`. A status about a step names its run in the value
    `run`. Other statuses are independent of runs.
    """

    def __init__(self, namespace: str, clock: RunClock) -> None:
        self._prefix, self._clock = namespace.rstrip("/") + "/", clock
        self._names: set[str] = set()

    def of(self, message: DiagnosticArray) -> list[diagnostics.NodeStatus]:
        """The selected statuses of a message.

        Raises:
            EarlyError: a status is of a later run.
            MessageError: a status is invalid, or there are too many nodes.
        """
        found = []
        for status in diagnostics.decode(message):
            if status.name.rpartition("/")[0] + "/" != self._prefix:
                continue
            if "step" in status.values and not self._is_present(status):
                continue
            if status.name not in self._names and len(self._names) == MOST_NODES:
                raise MessageError(
                    f"status.name: '{status.name}' is not allowed: {MOST_NODES} other nodes are "
                    "known"
                )
            self._names.add(status.name)
            found.append(status)
        return found

    def _is_present(self, status: diagnostics.NodeStatus) -> bool:
        if "run" not in status.values:
            raise MessageError(f"{status.name}: run: is missing: it must name the run of the step")
        return self._clock.is_present(status.values["run"])
