"""Subscriptions to topics that may have only one publisher."""

from collections.abc import Mapping
from time import monotonic
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy
from typing_extensions import override

from gameinfer_ros.nodes.base.checked_subscription import CheckedSubscription
from msg_adapters import MessageError

#: Stored messages of a publisher arrive within this time after a subscription, in s.
_HISTORY = 10.0

#: Period of the check for remaining publishers, in s.
_LOOK = 1.0


class SoleSubscription(CheckedSubscription):
    """A subscription that rejects all messages while its topic has several publishers.

    It cannot know which of several publishers is the right one. When only one is left, it
    subscribes again, so that this publisher sends its stored messages once more. Those newer than
    the last accepted message are handled. In this way no message is lost that another node expects
    an answer to.

    A killed publisher counts until the middleware detects its end; see `middleware`.
    """

    def __init__(self, *args: Any) -> None:
        self._newest = -1  # publication time of the last accepted message, in ns
        self._refused = False
        self._renewed = -_HISTORY
        super().__init__(*args)
        # The event for a lost publisher may be missed if another publisher appears just then.
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
        """Whether the message is new; an error names the nodes if there are several publishers."""
        published = info["source_timestamp"]
        if published <= self._newest and monotonic() < self._renewed + _HISTORY:
            return False
        count = self._subscription.get_publisher_count()
        if count > 1:
            self._refused = True
            publishers = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
            names = [f"{p.node_namespace.rstrip('/')}/{p.node_name}" for p in publishers]
            raise MessageError(
                f"{count} publishers ({', '.join(sorted(names))}), but only one is allowed: "
                "messages are ignored until the others are gone"
            )
        self._newest = published
        return True

    def _on_match(self, event: Any) -> None:
        self._settle(event.current_count)

    def _look(self) -> None:
        if self._refused:
            self._settle(self._node.count_publishers(self._subscription.topic_name))

    def _settle(self, publishers: int) -> None:
        """Subscribe again once only one publisher is left."""
        if not self._refused or publishers > 1:
            return
        self._refused = False
        if self._profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
            self._renewed = monotonic()
            super().destroy()
            self._subscription = self._subscribe()
