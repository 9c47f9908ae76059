"""A run with external people and an external base, in processes of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros_context import ros_context
from ros_domain import free_domain
from run_command import DEADLINE, Command, start

from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario
from msg_adapters import qos

__all__ = ["start"]
ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
STEPS = 25


@pytest.fixture
def domain() -> int:
    return free_domain()


@pytest.fixture
def start_example(tmp_path: Path, domain: int) -> Iterator[Any]:
    started: list[subprocess.Popen[bytes]] = []

    def make(example: str) -> None:
        environment = {
            **os.environ,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
        }
        with (tmp_path / f"{example}.log").open("wb") as log:
            started.append(
                subprocess.Popen(
                    [sys.executable, str(EXAMPLES / example)],
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    start_new_session=True,
                )
            )

    yield make
    for process in started:
        assert process.poll() is None, "the example has ended by itself"
        process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE) == 0


def test_the_robot_aligns_with_an_external_human(
    tmp_path: Path, domain: int, start: Callable[..., Command], start_example: Any
) -> None:
    command = start(
        *("--external", "human_1", "--steps", STEPS, "--out", tmp_path / "out", "--json"),
        *("--record", tmp_path / "bag"),
        domain=domain,
    )
    command.until(lambda: len(command.nodes()) == 4)
    assert not any("human_1_agent" in line for line in command.nodes().values())
    start_example("external_human.py")
    assert command.exit_code() == 0, command.stderr
    record = RunRecord.load(tmp_path / "out", Scenario.load("three_player").vehicles)
    assert record.steps >= STEPS
    walked = np.array(record.states)[:, 4:6] - record.states[0][4:6]
    distance = np.linalg.norm(walked, axis=1)
    # It walks 0.6 m/s, and it is known where it is at the time of each step.
    expected = 0.06 * np.arange(len(distance))
    known = np.isfinite(distance)
    assert known.sum() > STEPS / 2
    np.testing.assert_allclose(distance[known], expected[known], atol=0.06)
    assert record.beliefs, "nothing was inferred"
    # The bag has what the record has.
    bag = RunBag(tmp_path / "bag")
    assert bag.label.external == ["human_1"]
    np.testing.assert_array_equal(bag.record().states[-1], record.states[-1])
    assert bag.counts["/human_1/odom"] > STEPS
    assert "/human_1/control" not in bag.counts


def test_the_robot_can_be_an_external_base(
    tmp_path: Path, domain: int, start: Callable[..., Command], start_example: Any
) -> None:
    start_example("external_base.py")
    command = start("--scenario", "two_player", "--external", "robot", domain=domain)
    positions = [-3.0]
    with ros_context(domain) as context:
        node = Node("tester", context=context)
        node.create_subscription(
            Odometry, "robot/odom", lambda m: positions.append(m.pose.pose.position.x), qos.SENSOR
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)

        def moved() -> bool:
            executor.spin_once(timeout_sec=0)
            return positions[-1] > positions[0] + 0.1

        command.until(moved)
        node.destroy_node()
    command.process.send_signal(signal.SIGINT)
    assert command.exit_code() == 130, command.stderr


def test_options_that_do_not_fit_are_refused_at_once(start: Callable[..., Command]) -> None:
    for arguments, words in (
        (("--external", "bob"), ("--external", "'bob'", "robot, human_1, human_2")),
        (("--external", "human_1", "--time", "lockstep"), ("--external", "--time realtime")),
    ):
        command = start(*arguments)
        assert command.exit_code() == 2
        for word in words:
            assert word in command.stderr
