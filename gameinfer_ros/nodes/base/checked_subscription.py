"""Subscriptions that look at messages before they hand them on."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from time import monotonic, time_ns
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from gameinfer_ros.nodes.base.message_age import MessageAge
from gameinfer_ros.nodes.base.topic_faults import TopicFaults
from gameinfer_ros.runs.run_clock import EarlyError
from msg_adapters import MessageError

#: A message is at most so large, in bytes, where nothing else is said.
LARGEST = 65_536

#: Messages that are kept have at most this many bytes in total, unless it is a single one.
_KEPT_BYTES = 2**24


@dataclass
class _Received:
    """A message, its bytes, and when it was published and arrived, by `monotonic`.

    While it is kept, `why` says why, and `reported` whether it was reported as rejected.
    """

    message: Any
    size: int
    published: float
    arrived: float
    why: MessageError | None = None
    reported: bool = False


class CheckedSubscription:
    """A subscription whose messages are handled if they can be used, and else only reported.

    Messages that raise `EarlyError` are kept, up to some number, and handled again by
    `offer_again`. One that is dropped, or kept for a while, is reported.

    Args:
        node: the node that subscribes.
        message_type: type of the messages.
        topic: the topic.
        handle: gets each message, and for how many seconds it waited to be handled; a
            `MessageError` of it says that the message cannot be used.
        profile: its quality of service.
        faults: told what goes wrong.
        largest: one of more bytes is not read: that alone could take seconds.
        keep: number of messages to keep, the newest ones.

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
        keep: int = 0,
    ) -> None:
        self._node, self._type, self._topic = node, message_type, topic
        self._handle, self._profile, self._faults = handle, profile, faults
        self._largest, self._ages, self.age = largest, MessageAge(), 0.0
        self._keep, self._kept = keep, deque[_Received]()
        self._subscription = self._subscribe()

    @property
    def kept(self) -> int:
        """Number of messages that are kept."""
        return len(self._kept)

    def destroy(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)

    def offer_again(self) -> None:
        """Handle the messages that are kept once more."""
        kept, self._kept = self._kept, deque()
        for received in kept:
            self._offer(received)

    def report_kept(self, seconds: float) -> None:
        """Report the messages that have been kept for longer than this; they stay kept."""
        for received in self._kept:
            if monotonic() - received.arrived > seconds:
                self._report(received)

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
            if not self._counts(info):
                return
            message = self._read(data)
        except MessageError as error:
            self._faults.reject(self._topic, error)
            return
        # Some middlewares leave times out, as 0; and clocks may be set back meanwhile.
        arrival = info["received_timestamp"] or info["source_timestamp"] or time_ns()
        published = info["source_timestamp"] or arrival
        arrived = monotonic() - max(0.0, 1e-9 * (time_ns() - arrival))
        age = self._ages.at(1e-9 * published, 1e-9 * arrival)
        self._offer(_Received(message, len(data), arrived - age, arrived))

    def _offer(self, received: _Received) -> None:
        now = monotonic()
        self.age = now - received.published
        try:
            self._handle(received.message, now - received.arrived)
        except EarlyError as error:
            received.why = error
            self._put_aside(received)
        except MessageError as error:
            self._faults.reject(self._topic, error)

    def _put_aside(self, received: _Received) -> None:
        self._kept.append(received)
        while len(self._kept) > self._keep or (
            len(self._kept) > 1 and sum(r.size for r in self._kept) > _KEPT_BYTES
        ):
            self._report(self._kept.popleft())

    def _report(self, received: _Received) -> None:
        if received.why is not None and not received.reported:
            received.reported = True
            self._faults.reject(self._topic, received.why)

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
