"""Publishing after the context of a node has been shut down."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic, sleep
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher

#: Longest time that the delivery of the last message may take, in s.
PATIENCE = 0.5

#: Time between the messages until one is acknowledged, in s.
_REPETITION = Duration(seconds=0.02)


@contextmanager
def last_publisher(
    publisher: Publisher,
    listeners: int,
    domain: int,
    repeated: Callable[[], Any],
    discovery: float,
) -> Iterator[Callable[[Any], None]]:
    """Replace a publisher that no longer works because its context has been shut down.

    Args:
        publisher: the publisher.
        listeners: number of its subscriptions; the new one waits until it has discovered as many.
        domain: its domain ID.
        repeated: makes the message that is published until all subscriptions acknowledge it. A
            subscription that has not discovered the new publisher yet misses what it publishes.
        discovery: longest time that discovery may take, in s. It usually takes 0.3 s.

    Yields:
        A function that publishes a message.
    """
    context = rclpy.Context()
    context.init(initialize_logging=False, domain_id=domain)
    node = Node(
        "last_publisher",
        context=context,
        use_global_arguments=False,  # the name of the topic is complete already
        start_parameter_services=False,
        enable_rosout=False,
    )
    try:
        last = node.create_publisher(
            publisher.msg_type, publisher.topic_name, publisher.qos_profile
        )
        deadline = monotonic() + discovery
        while last.get_subscription_count() < listeners and monotonic() < deadline:
            sleep(0.01)
        last.publish(repeated())
        while not last.wait_for_all_acked(_REPETITION) and monotonic() < deadline:
            last.publish(repeated())
        yield last.publish
        last.wait_for_all_acked(Duration(seconds=PATIENCE))
    finally:
        node.destroy_node()
        context.try_shutdown()
