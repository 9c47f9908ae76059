"""Subscriptions that reject and report invalid messages."""

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

#: Default limit on the size of a message, in bytes.
LARGEST = 65_536

#: Limit on the total size of all kept messages, in bytes. A single message may exceed it.
_KEPT_BYTES = 2**24


@dataclass
class _Received:
    message: Any
    size: int  # in bytes, serialized
    published: float  # by `time.monotonic`, in s
    arrived: float  # likewise
    why: MessageError | None = None  # why it is kept
    reported: bool = False  # while it was kept


class CheckedSubscription:
    """A subscription that passes valid messages to a callback, and rejects and reports others.

    With `keep`, messages for which the callback raises `EarlyError` are kept. `offer_again` passes
    them to the callback again. A message is reported if it is dropped, or kept for too long.

    Args:
        node: the node that subscribes.
        message_type: type of the messages.
        topic: name of the topic.
        handle: callback. It gets each message and the time the message waited to be handled, in s.
            It raises `MessageError` if the message is invalid.
        profile: quality of service.
        faults: collects rejected messages and incompatible publishers.
        largest: largest size of a message, in bytes. Larger messages are rejected without being
            deserialized, which could take seconds.
        keep: whether to keep messages, at most as many as the depth of the profile; the oldest are
            dropped first.
        shared: whether to ignore incompatible publishers, which may be of other systems.

    Attributes:
        age: time since the publication of the message that is being handled, in s.
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
        keep: bool = False,
        shared: bool = False,
    ) -> None:
        self._node, self._type, self._topic = node, message_type, topic
        self._handle, self._profile, self._faults = handle, profile, faults
        self._largest, self._ages, self.age = largest, MessageAge(), 0.0
        self._most_kept, self._kept = profile.depth if keep else 0, deque[_Received]()
        self._shared = shared
        self._subscription = self._subscribe()

    @property
    def kept(self) -> int:
        """Number of kept messages."""
        return len(self._kept)

    def destroy(self) -> None:
        """Destroy the subscription."""
        self._node.destroy_subscription(self._subscription)

    def offer_again(self) -> None:
        """Pass all kept messages to the callback again."""
        kept, self._kept = self._kept, deque()
        for received in kept:
            self._offer(received)

    def report_kept(self, seconds: float) -> None:
        """Report messages that have been kept for longer than `seconds`, and still keep them."""
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
        report = partial(self._faults.incompatible, self._topic, "publisher")
        return SubscriptionEventCallbacks(
            incompatible_qos=(lambda event: None) if self._shared else report
        )

    def _receive(self, data: bytes, info: Mapping[str, int]) -> None:
        try:
            if not self._counts(info):
                return
            if len(data) > self._largest:
                raise MessageError(f"has {len(data)} bytes; at most {self._largest} are allowed")
            try:
                message = deserialize_message(data, self._type)
            except RuntimeError as error:
                raise MessageError(f"cannot be read as {self._type.__name__}: {error}") from None
        except MessageError as error:
            self._faults.reject(self._topic, error)
            return
        # Some middlewares set missing times to 0, and a clock may have been set back meanwhile.
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
            self._kept.append(received)
            while len(self._kept) > self._most_kept or (
                len(self._kept) > 1 and sum(r.size for r in self._kept) > _KEPT_BYTES
            ):
                self._report(self._kept.popleft())
        except MessageError as error:
            self._faults.reject(self._topic, error)

    def _report(self, received: _Received) -> None:
        if received.why is not None and not received.reported:
            received.reported = True
            self._faults.reject(self._topic, received.why)

    def _counts(self, info: Mapping[str, int]) -> bool:
        """Whether to read a message; if not, it is ignored. Raises `MessageError` to reject it."""
        return True
