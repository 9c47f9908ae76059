"""Subscriptions that look at messages before they hand them on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from time import time_ns
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from gameinfer_ros.nodes.base.message_age import MessageAge
from gameinfer_ros.nodes.base.topic_faults import TopicFaults
from msg_adapters import MessageError

#: A message is at most so large, in bytes, where nothing else is said.
LARGEST = 65_536


class CheckedSubscription:
    """A subscription whose messages are handled if they can be used, and else only reported.

    Args:
        node: the node that subscribes.
        message_type: type of the messages.
        topic: the topic.
        handle: gets each message, and for how many seconds it waited to be handled; a
            `MessageError` of it says that the message cannot be used.
        profile: its quality of service.
        faults: told what goes wrong.
        largest: one of more bytes is not read: that alone could take seconds.

    Attributes:
        age: how long ago the message that is being handled was published, in s.
    """

    def __init__(
        self,
        node: Node,
        message_type: Any,
        topic: str,
        handle: Callable[[Any, float], None],
        profile: QoSProfile,
        faults: TopicFaults,
        largest: int = LARGEST,
    ) -> None:
        self._node, self._type, self._topic = node, message_type, topic
        self._handle, self._profile, self._faults = handle, profile, faults
        self._largest, self._ages, self.age = largest, MessageAge(), 0.0
        self._subscription = self._subscribe()

    def destroy(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)

    def _subscribe(self) -> Subscription:
        return self._node.create_subscription(
            self._type,
            self._topic,
            self._receive,
            self._profile,
            event_callbacks=self._events(),
            raw=True,
        )

    def _events(self) -> SubscriptionEventCallbacks:
        return SubscriptionEventCallbacks(
            incompatible_qos=partial(self._faults.incompatible, self._topic, "publisher")
        )

    def _receive(self, data: bytes, info: Mapping[str, int]) -> None:
        try:
            if self._counts(info):
                message = self._read(data)
                # Some middlewares leave times out, as 0; and clocks may be set back meanwhile.
                arrival = info["received_timestamp"] or info["source_timestamp"] or time_ns()
                published = info["source_timestamp"] or arrival
                waited = max(0.0, 1e-9 * (time_ns() - arrival))
                self.age = waited + self._ages.at(1e-9 * published, 1e-9 * arrival)
                self._handle(message, waited)
        except MessageError as error:
            self._faults.reject(self._topic, error)

    def _counts(self, info: Mapping[str, int]) -> bool:
        """Whether a message, of which the middleware tells this, is to be read.

        Raises:
            MessageError: it is not, and the message says why.
        """
        return True

    def _read(self, data: bytes) -> Any:
        """The message that was sent as these bytes.

        Raises:
            MessageError: there are too many of them, or they are no such message.
        """
        if len(data) > self._largest:
            raise MessageError(f"has {len(data)} bytes; at most {self._largest} are allowed")
        try:
            return deserialize_message(data, self._type)
        except RuntimeError as error:
            raise MessageError(f"cannot be read as {self._type.__name__}: {error}") from None
