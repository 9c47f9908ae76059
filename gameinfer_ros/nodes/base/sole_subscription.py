"""Subscriptions to topics on which only one node may speak."""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy
from typing_extensions import override

from gameinfer_ros.nodes.base.checked_subscription import CheckedSubscription
from msg_adapters import MessageError

#: What a publisher has kept for those who join late arrives within this time, in s.
_HISTORY = 10.0

#: How often it is looked whether the others are gone, in s.
_LOOK = 1.0


class SoleSubscription(CheckedSubscription):
    """A subscription whose messages count only while they have a single publisher.

    Nobody knows which of several is right. When the others are gone, the subscription is made
    anew: the one that is left sends once more what it has kept, and of that counts what is newer
    than the last message that did. So nothing is lost that somebody waits for an answer to.

    A publisher that was killed counts until the middleware gives it up; see `middleware`.
    """

    def __init__(self, *args: Any) -> None:
        self._newest = -1  # when the newest message that counted was published, in ns
        self._refused = False
        self._renewed = -_HISTORY
        super().__init__(*args)
        # The event that a publisher has gone may be lost where another one comes just then.
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = self._node.create_timer(_LOOK, self._look, clock=clock)

    @override
    def destroy(self) -> None:
        self._node.destroy_timer(self._timer)
        super().destroy()

    @override
    def _events(self) -> SubscriptionEventCallbacks:
        callbacks = super()._events()
        callbacks.matched = self._on_match
        return callbacks

    @override
    def _counts(self, info: Mapping[str, int]) -> bool:
        """Whether the message has not counted before.

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
            names = [f"{p.node_namespace.rstrip('/')}/{p.node_name}" for p in publishers]
            raise MessageError(
                f"{count} publishers ({', '.join(sorted(names))}), and only one is allowed: "
                "nothing counts until the others are gone"
            )
        self._newest = published
        return True

    def _on_match(self, event: Any) -> None:
        self._settle(event.current_count)

    def _look(self) -> None:
        if self._refused:
            self._settle(self._node.count_publishers(self._subscription.topic_name))

    def _settle(self, publishers: int) -> None:
        """Hear the one that is left."""
        if not self._refused or publishers > 1:
            return
        self._refused = False
        if self._profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
            self._renewed = monotonic()
            super().destroy()
            self._subscription = self._subscribe()
