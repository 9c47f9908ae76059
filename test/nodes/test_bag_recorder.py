"""What the recorder of bags does when something goes wrong."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from geometry_msgs.msg import TwistStamped
from ros_context import ros_context
from small_scenario import ScenarioFile

from gameinfer_ros.bags.inspection import inspect
from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from msg_adapters import qos

DEADLINE = 60.0


@pytest.fixture
def recorder(tmp_path: Path, scenario_file: ScenarioFile) -> Iterator[BagRecorder]:
    label = BagLabel("uu", "map", "lockstep", 0)
    with ros_context() as context:
        node = BagRecorder(
            tmp_path / "bag", scenario_file("uu"), label, context=context, namespace="/x"
        )
        yield node
        node.destroy_node()


def test_a_bag_without_messages_can_be_read(recorder: BagRecorder, tmp_path: Path) -> None:
    recorder.start()
    recorder.close()
    assert recorder.failure is None
    assert recorder.messages == 0
    bag = RunBag(tmp_path / "bag")
    assert bag.label.namespace == "/x"
    assert bag.label.topics["belief"] == "/x/belief"
    assert bag.label.topics["/diagnostics"] == "/diagnostics"
    assert bag.counts == {} and bag.seconds == 0
    assert bag.record().states == []


def test_lost_messages_are_counted(recorder: BagRecorder, tmp_path: Path) -> None:
    for number in (1, 2, 5, 6, 8):
        recorder._check_whole("belief", number)
    recorder._check_whole("markers", 3)
    recorder._check_whole("/diagnostics", 7)  # of many publishers
    assert recorder.lost == {"belief": 3, "markers": 2}
    recorder.start()
    recorder.close()
    found = inspect(RunBag(tmp_path / "bag"))
    assert found["lost"] == {"belief": 3, "markers": 2}


def test_the_recorder_subscribes_to_states_last(recorder: BagRecorder) -> None:
    recorder.start()
    assert recorder.count_subscribers("joint_state") == 0
    assert recorder.count_subscribers("belief") == 1
    recorder.close()


def test_a_bag_that_cannot_be_written_is_a_failure(recorder: BagRecorder) -> None:
    recorder._writer.storage.bio.close()  # as if the disk were full
    recorder.start()
    recorder.close()
    assert recorder.failure is not None


def test_a_publisher_that_does_not_stop_does_not_keep_the_bag_open(
    recorder: BagRecorder, tmp_path: Path
) -> None:
    stranger = rclpy.create_node("stranger", context=recorder.context)
    publisher = stranger.create_publisher(TwistStamped, "/x/robot/cmd_vel", qos.COMMAND)
    enough = threading.Event()

    def publish() -> None:
        while not enough.wait(0.1):
            publisher.publish(TwistStamped())

    threads = [threading.Thread(target=f, daemon=True) for f in (publish, recorder.close)]
    try:
        recorder.start()
        threads[0].start()
        deadline = time.monotonic() + DEADLINE
        while recorder.messages == 0:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        threads[1].start()
        threads[1].join(DEADLINE)
        assert not threads[1].is_alive(), "it waits for a stranger to end"
    finally:
        enough.set()
        for thread in filter(threading.Thread.is_alive, threads):
            thread.join(DEADLINE)
        stranger.destroy_node()
    assert recorder.failure is None
    assert sum(RunBag(tmp_path / "bag").counts.values()) == recorder.messages
