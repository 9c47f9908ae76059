"""Counts and logs of rejected messages and incompatible peers."""

from collections import Counter
from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.qos import qos_policy_name_from_kind

from gameinfer_ros.names.text import shorten
from msg_adapters import MessageError

#: Largest length of the reason for a rejected message, in characters.
LONGEST_REASON = 500


class TopicFaults:
    """Logs and counts rejected messages and peers with an incompatible quality of service.

    Attributes:
        rejected: number of rejected messages by topic.
        last_rejection: log message of the last rejection; empty if there was none.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self.rejected: Counter[str] = Counter()
        self.last_rejection = ""
        self._logger = logger
        self._incompatible: Counter[str] = Counter()

    def reject(self, topic: str, reason: MessageError) -> None:
        """Log and count a rejected message, at most one log line a second."""
        self.rejected[topic] += 1
        shown = shorten(str(reason), LONGEST_REASON)
        self.last_rejection = f"message on {topic} rejected: {shown}"
        self._logger.error(self.last_rejection, throttle_duration_sec=1.0)

    def incompatible(self, topic: str, peer: str, event: Any) -> None:
        """Log and count an incompatible `publisher` or `subscriber`, by the QoS event of rclpy."""
        self._incompatible[topic] = event.total_count
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        verb = "offers" if peer == "publisher" else "requests"
        self._logger.error(
            f"a {peer} of {topic} {verb} an incompatible quality of service ({policy}), so no "
            f"messages are exchanged with it: compare both with `ros2 topic info -v {topic}`"
        )

    def figures(self) -> dict[str, str]:
        """Values for the status of the node in `/diagnostics`."""
        figures = {"rejected_messages": str(self.rejected.total())}
        if self.last_rejection:
            figures["last_rejection"] = self.last_rejection
        if self._incompatible:
            figures["incompatible_peers"] = str(self._incompatible.total())
        return figures
