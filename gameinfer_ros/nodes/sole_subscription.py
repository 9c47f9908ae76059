"""Subscriptions to topics on which only one node may speak."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from msg_adapters import MessageError

#: What a publisher has kept for those who join late arrives within this time, in s.
_HISTORY = 1.0


class SoleSubscription:
    """A subscription whose messages count only while they have a single publisher.

    Nobody knows which of several is right. When the others are gone, the subscription is made
    anew: the one that is left sends once more what it has kept, and of that counts what is newer
    than the last message that did. So nothing is lost that somebody waits for an answer to.

    A publisher that was killed counts until the middleware gives it up; see `middleware`.

    Args:
        node: the node that subscribes.
        message_type: type of the messages.
        topic: the topic.
        receive: gets the bytes of each message, and what the middleware tells of it; asks whether
            it `counts`.
        profile: its quality of service.
        callbacks: as for other subscriptions.
    """

    def __init__(
        self,
        node: Node,
        message_type: Any,
        topic: str,
        receive: Callable[[bytes, Mapping[str, int]], None],
        profile: QoSProfile,
        callbacks: SubscriptionEventCallbacks,
    ) -> None:
        self._node = node
        callbacks.matched = self._on_match
        self._arguments = {
            "msg_type": message_type,
            "topic": topic,
            "callback": receive,
            "qos_profile": profile,
            "event_callbacks": callbacks,
            "raw": True,
        }
        self._keeps = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        self._newest = -1  # when the newest message that counted was published, in ns
        self._refused = False
        self._renewed = -_HISTORY
        self._subscription: Subscription = node.create_subscription(**self._arguments)

    def destroy(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)

    def counts(self, info: Mapping[str, int]) -> bool:
        """Whether a message, of which the middleware tells this, has not counted before.

        Raises:
            MessageError: there are several publishers; it names their nodes.
        """
        published = info["source_timestamp"]
        if published <= self._newest and monotonic() < self._renewed + _HISTORY:
            return False
        count = self._subscription.get_publisher_count()
        if count > 1:
            self._refused = True
            publishers = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
            names = {f"{p.node_namespace.rstrip('/')}/{p.node_name}" for p in publishers}
            raise MessageError(
                f"{count} publishers ({', '.join(sorted(names))}), and only one is allowed: "
                "nothing counts until the others are gone"
            )
        self._newest = published
        return True

    def _on_match(self, event: Any) -> None:
        if self._refused and event.current_count <= 1:
            self._refused = False
            if self._keeps:
                self._renewed = monotonic()
                self.destroy()
                self._subscription = self._node.create_subscription(**self._arguments)
