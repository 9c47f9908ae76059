"""What goes wrong on the topics of a node."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.qos import qos_policy_name_from_kind

from gameinfer_ros.names.text import shorten
from msg_adapters import MessageError

#: What is said of a message that is rejected is at most so long, in characters.
LONGEST_REASON = 500


class TopicFaults:
    """Says what goes wrong on the topics of a node, and counts it.

    Args:
        logger: of the node.

    Attributes:
        rejected: how many messages of each topic could not be used.
        last_rejection: what was said of the last one.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self.rejected: Counter[str] = Counter()
        self.last_rejection = ""
        self._logger = logger
        self._incompatible: Counter[str] = Counter()

    def reject(self, topic: str, reason: MessageError) -> None:
        """A message cannot be used."""
        self.rejected[topic] += 1
        said = shorten(str(reason), LONGEST_REASON)
        self.last_rejection = f"message on {topic} rejected: {said}"
        self._logger.error(self.last_rejection, throttle_duration_sec=1.0)

    def incompatible(self, topic: str, peer: str, event: Any) -> None:
        """A peer, a `publisher` or `subscriber`, has a quality of service that does not fit."""
        self._incompatible[topic] = event.total_count
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        does = "offers" if peer == "publisher" else "asks for"
        self._logger.error(
            f"a {peer} of {topic} {does} another quality of service ({policy}), so no message "
            f"passes between it and this node: `ros2 topic info -v {topic}` shows both"
        )

    def figures(self) -> dict[str, str]:
        """What a report of the node tells of it."""
        figures = {"rejected_messages": str(self.rejected.total())}
        if self.last_rejection:
            figures["last_rejection"] = self.last_rejection
        if self._incompatible:
            figures["incompatible_peers"] = str(self._incompatible.total())
        return figures
