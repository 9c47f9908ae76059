"""The QoS profiles connect publishers and subscribers, and serve late subscribers."""

from __future__ import annotations

import pytest
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32
from world import World

from msg_adapters import qos

PROFILES = {
    "STREAM": qos.STREAM,
    "LATEST": qos.LATEST,
    "RECENT": qos.RECENT,
    "COMMAND": qos.COMMAND,
    "DIAGNOSTICS": qos.DIAGNOSTICS,
    "ANY_DIAGNOSTICS": qos.ANY_DIAGNOSTICS,
    "CLOCK": qos.CLOCK,
}
VIEWER = QoSProfile(
    depth=10, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
)


class Peers:
    def __init__(self, world: World) -> None:
        self._node, self.until, self.spin = world.tester, world.until, world.spin

    def publisher(self, profile: QoSProfile) -> Publisher:
        return self._node.create_publisher(Int32, "topic", profile)

    def hear(self, profile: QoSProfile) -> list[int]:
        heard: list[int] = []
        self._node.create_subscription(Int32, "topic", lambda m: heard.append(m.data), profile)
        return heard


@pytest.fixture
def peers(world: World) -> Peers:
    return Peers(world)


@pytest.mark.parametrize("name", PROFILES)
def test_publisher_and_subscriber_with_a_profile_connect(name: str, peers: Peers) -> None:
    publisher = peers.publisher(PROFILES[name])
    heard = peers.hear(PROFILES[name])
    peers.until(lambda: publisher.get_subscription_count() == 1)
    for number in range(3):
        publisher.publish(Int32(data=number))
        peers.until(lambda number=number: number in heard)
    assert heard == [0, 1, 2]


@pytest.mark.parametrize("name", PROFILES)
def test_a_best_effort_viewer_hears_every_publisher(name: str, peers: Peers) -> None:
    publisher = peers.publisher(PROFILES[name])
    heard = peers.hear(VIEWER)
    peers.until(lambda: publisher.get_subscription_count() == 1)
    # Best effort may lose one.
    number = 0

    def repeated() -> bool:
        nonlocal number
        number += 1
        publisher.publish(Int32(data=number))
        return len(heard) >= 2

    peers.until(repeated)
    assert heard == sorted(heard)


def test_who_joins_a_stream_late_hears_it_all_in_order(peers: Peers) -> None:
    publisher = peers.publisher(qos.STREAM)
    for number in range(150):  # longer than a run of the paper
        publisher.publish(Int32(data=number))
    heard = peers.hear(qos.STREAM)
    peers.until(lambda: len(heard) >= 150)
    publisher.publish(Int32(data=150))
    peers.until(lambda: 150 in heard)
    assert heard == list(range(151))


def test_early_statuses_reach_a_recorder_that_joins_late(peers: Peers) -> None:
    publisher = peers.publisher(qos.DIAGNOSTICS)
    for number in range(20):
        publisher.publish(Int32(data=number))
    heard, as_they_come = peers.hear(qos.DIAGNOSTICS), peers.hear(qos.ANY_DIAGNOSTICS)
    peers.until(lambda: publisher.get_subscription_count() == 2 and 19 in heard)
    publisher.publish(Int32(data=20))
    peers.until(lambda: 20 in heard and 20 in as_they_come)
    assert heard == list(range(21))
    assert as_they_come == [20]


def test_a_volatile_subscriber_hears_publishers_of_other_systems(peers: Peers) -> None:
    publisher = peers.publisher(QoSProfile(depth=10))
    heard = peers.hear(qos.ANY_DIAGNOSTICS)
    peers.until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(Int32(data=1))
    peers.until(lambda: heard == [1])


def test_who_wants_only_the_newest_of_a_stream_gets_it(peers: Peers) -> None:
    publisher = peers.publisher(qos.STREAM)
    for number in range(20):
        publisher.publish(Int32(data=number))
    heard = peers.hear(qos.LATEST)
    peers.until(lambda: 19 in heard)
    assert heard[-1] == 19


def test_who_joins_late_hears_the_last_of_what_only_matters_in_its_newest_version(
    peers: Peers,
) -> None:
    publisher = peers.publisher(qos.LATEST)
    for number in range(5):
        publisher.publish(Int32(data=number))
    heard = peers.hear(qos.LATEST)
    peers.until(lambda: bool(heard))
    publisher.publish(Int32(data=5))
    peers.until(lambda: 5 in heard)
    assert heard == [4, 5]


@pytest.mark.parametrize("name", ["COMMAND", "CLOCK"])
def test_an_old_command_does_not_move_a_base_that_joins_late(name: str, peers: Peers) -> None:
    publisher = peers.publisher(PROFILES[name])
    publisher.publish(Int32(data=1))
    heard = peers.hear(PROFILES[name])
    peers.until(lambda: publisher.get_subscription_count() == 1)
    peers.spin(0.3)  # time in which the old one would arrive
    publisher.publish(Int32(data=2))
    peers.until(lambda: 2 in heard)
    assert heard == [2]
