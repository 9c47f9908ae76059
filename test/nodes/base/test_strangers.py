"""What nobody expects to be published moves nobody, and when it is gone all go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import forking
import numpy as np
import pytest
from arena import Arena
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from test_robot_planner_node import Robot, some_state
from trajectory_msgs.msg import MultiDOFJointTrajectory
from wire import START

from gameinfer_ros.nodes.base import middleware
from gameinfer_ros.nodes.base.sole_subscription import SoleSubscription
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos, stamp

pytestmark = pytest.mark.alone

DEADLINE = 60.0
#: Fast DDS gives up a process that was killed after 3 s if it is told so, and after 20 s if not.
GIVEN_UP = 15.0

ScenarioFile = Callable[..., Path]


class Stranger:
    """A node that nobody knows, which publishes what others do."""

    def __init__(self, world: Any) -> None:
        self._world = world
        self._node = Node("stranger", context=world.tester.context)

    def publisher(self, message_type: Any, topic: str, profile: Any = qos.STREAM) -> Publisher:
        """A publisher to which somebody listens."""
        publisher = self._node.create_publisher(message_type, topic, profile)
        self._world.until(publisher.get_subscription_count)
        return publisher

    def leave(self) -> None:
        self._node.destroy_node()


@pytest.fixture
def stranger(world: Any) -> Iterator[Stranger]:
    stranger = Stranger(world)
    yield stranger
    stranger.leave()


def rejections(reports: list[diagnostics.NodeStatus]) -> int:
    return int(reports[-1].values["rejected_messages"]) if reports else 0


@pytest.mark.parametrize("topic", ["joint_state", "robot_strategy"])
def test_the_robot_brakes_while_somebody_else_speaks_and_then_goes_on(
    topic: str,
    world: Any,
    wire: Any,
    scenario_file: ScenarioFile,
    stranger: Stranger,
    capfd: pytest.CaptureFixture[str],
) -> None:
    file = scenario_file("uu", horizon=50)
    robot = Robot(world, wire, file, time="realtime", brake_after=2.0)
    robot.be_told(0, horizon=50)
    robot.see(0, some_state(robot, 0))
    robot.wait(1)
    done, before = len(robot.controls), rejections(robot.reports)
    if topic == "joint_state":
        other = stranger.publisher(MultiDOFJointState, topic)
        for step in range(1, 40):
            world.send(other, robot.wire.state(step, some_state(robot, step)))
            world.send(robot._states, robot.wire.state(step, some_state(robot, step)))
    else:
        other = stranger.publisher(Float64MultiArray, topic)
        told = robot._strategies
        robot._strategies = other
        for step in range(1, 40):
            robot.be_told(step)
        robot._strategies = told
    # Neither what the stranger says counts nor, while it is there, what the others say.
    assert len(robot.controls) == done
    world.until(lambda: rejections(robot.reports) >= before + 39)
    missing = "no joint_state" if topic == "joint_state" else "no "
    world.until(lambda: robot.reports[-1].message.startswith(f"brakes: {missing}"))
    world.until(lambda: not robot.velocities[-1].any())
    words = capfd.readouterr().err
    assert f"message on {topic} rejected: 2 publishers (/stranger, /tester), but only one" in words
    stranger.leave()
    world.until(lambda: robot.node.count_publishers(topic) == 1)
    told, steps = robot.be_told(40, horizon=50), iter(range(40, 80))

    def obeys() -> bool:
        step = next(steps)
        robot.see(step, some_state(robot, step))
        world.until(lambda: robot.controls[-1][0] == step)
        return np.allclose(
            robot.controls[-1][1][0],
            robot.reaction(told, step, some_state(robot, step)),
            atol=1e-12,
        )

    # The strategy may arrive after the first states.
    world.until(obeys)


@pytest.mark.parametrize("told", [True, False], ids=["told", "not told"])
def test_what_was_refused_counts_when_the_stranger_is_gone_and_the_rest_not_twice(
    told: bool,
    world: Any,
    wire: Any,
    scenario_file: ScenarioFile,
    stranger: Stranger,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not told:  # events may be lost
        monkeypatch.setattr(SoleSubscription, "_on_match", lambda subscription, event: None)
    robot = Robot(world, wire, scenario_file("uu"))
    for step in range(3):
        robot.be_told(step)
        robot.see(step, some_state(robot, step))
        world.until(lambda step=step: len(robot.controls) == step + 1)
    robot.be_told(3)
    stranger.publisher(MultiDOFJointState, "joint_state")
    robot.see(3, some_state(robot, 3))  # lockstep: nobody says it again
    world.spin(0.5)
    assert len(robot.controls) == 3
    stranger.leave()
    world.until(lambda: len(robot.controls) == 4)
    assert [step for step, _ in robot.controls] == [0, 1, 2, 3]
    robot.be_told(4)
    robot.see(4, some_state(robot, 4))
    world.until(lambda: len(robot.controls) == 5)
    # That of step 3 was refused once; those before have not come again.
    assert rejections(robot.reports) == 1


def test_a_start_of_a_stranger_is_no_new_run(
    world: Any, wire: Any, scenario_file: ScenarioFile, stranger: Stranger
) -> None:
    agent = world.add(HumanAgent, scenario=scenario_file("uu"))
    states, wire = world.states(), wire(agent.scenario)
    reports = world.reports(agent)
    other = stranger.publisher(Time, "run_start", qos.LATEST)
    world.until(lambda: agent.count_publishers("run_start") == 2)
    for step in range(3):
        world.send(other, stamp.encode(START + 10**10 * (step + 1)))
        world.send(states, wire.state(step, agent.scenario.initial_state))
        world.until(lambda step=step: reports and reports[-1].values["step"] == str(step))
    assert rejections(reports) == 3
    stranger.leave()
    world.until(lambda: agent.count_publishers("run_start") == 1)
    world.start_run(START + 10**11)
    world.until(lambda: agent.clock.start == START + 10**11, "the next run does not start")


def test_inputs_of_a_stranger_move_no_simulated_player(
    world: Any, wire: Any, scenario_file: ScenarioFile, stranger: Stranger
) -> None:
    file = scenario_file("uu", steps=1000)
    scenario = Scenario.load(file)
    simulator = world.add(Simulator, scenario=file)
    wire = wire(scenario, simulator.clock)
    hands = {
        name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        for name in scenario.players
    }
    heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: heard)
    # Players that nobody knows have no topic of theirs: a control for them goes nowhere.
    topics = {name for name, _ in simulator.get_topic_names_and_types() if "control" in name}
    assert topics == {"/robot/control", "/human_1/control"}
    other = stranger.publisher(MultiDOFJointTrajectory, "human_1/control")
    world.send(hands["robot"], wire.control("robot", 0, [0.1, 0.2]))
    for _ in range(5):
        world.send(other, wire.control("human_1", 0, [9.0, 9.0]))
    world.send(hands["human_1"], wire.control("human_1", 0, [0.3, 0.4]))
    world.spin(0.5)
    assert simulator.world.step == 0
    stranger.leave()
    world.until(lambda: len(heard) > 1)
    expected = scenario.game.step(scenario.initial_state, np.array([0.1, 0.2, 0.3, 0.4]))
    np.testing.assert_allclose(wire.read_state(heard[-1]), expected, atol=1e-9)


def test_odometry_of_a_stranger_moves_no_external_player(
    world: Any, wire: Any, scenario_file: ScenarioFile, stranger: Stranger
) -> None:
    arena = Arena(world, wire, scenario_file("uu", steps=30), "human_1", odom_timeout=0.45)
    arena.begin("human_1")
    arena.tell("human_1", 0.1)
    arena.set_clock(0.1)
    world.until(lambda: 1 in arena.states)
    mine = arena._odom["human_1"]
    other = stranger.publisher(Odometry, "human_1/odom", qos.SENSOR)
    for step in range(2, 9):
        for arena._odom["human_1"] in (other, mine):
            arena.tell("human_1", arena.dt * step)
        arena.set_clock(arena.dt * step)
    world.until(arena.say("missing: human_1"))
    # As long as its last odometry lasts, and no longer.
    assert max(arena.states) == 5
    stranger.leave()
    world.until(
        lambda: mine.get_subscription_count() and arena.node.count_publishers("human_1/odom") == 1
    )
    arena.tell("human_1", 0.9)
    arena.set_clock(0.9)
    world.until(lambda: 9 in arena.states)


def start(module: str, domain: int, log: Path, *arguments: str) -> forking.Forked:
    """A node in a process of its own, which gets no settings for the middleware."""
    environment = {
        k: v for k, v in os.environ.items() if k not in (middleware.FAST_DDS, middleware.RANGE)
    }
    with log.open("wb") as output:
        return forking.start(
            [sys.executable, "-m", f"gameinfer_ros.nodes.{module}", "--ros-args", *arguments],
            env={**environment, "ROS_DOMAIN_ID": str(domain)},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def test_a_simulator_that_is_killed_and_started_again_is_not_taken_for_two(
    world: Any, scenario_file: ScenarioFile, tmp_path: Path
) -> None:
    file, domain = scenario_file("uu", steps=100_000), world.tester.context.get_domain_id()
    stamps: list[int] = []

    def note(message: MultiDOFJointState) -> None:
        stamps.append(stamp.decode(message.header.stamp))

    subscription = world.tester.create_subscription(
        MultiDOFJointState, "joint_state", note, qos.LATEST
    )
    starts = world.hear(Time, "run_start", qos.LATEST, senders=0)
    settings = ("-p", f"scenario:={file}", "-p", "time:=realtime")
    nodes = [
        start("inference", domain, tmp_path / "inference", *settings),
        start("robot_planner", domain, tmp_path / "robot", *settings),
        start("human_agent", domain, tmp_path / "human", *settings),
        start("simulator", domain, tmp_path / "one", *settings),
    ]
    try:
        # On a busy machine only some of the states are seen.
        world.until(lambda: starts and stamps and stamps[-1] > stamps[0] + 2 * 10**9)
        nodes[-1].send_signal(signal.SIGKILL)
        killed = time.monotonic()
        nodes.append(start("simulator", domain, tmp_path / "two", *settings))
        world.until(lambda: len(starts) > 1)  # the second one has begun
        # It goes on only if both players have answered to its first state.
        world.until(lambda: stamps[-1] > stamp.decode(starts[-1]))
        world.until(lambda: subscription.get_publisher_count() == 1)
        assert time.monotonic() < killed + GIVEN_UP + 30.0
    finally:
        for node in nodes:
            node.send_signal(signal.SIGINT)
        for node in nodes:
            node.wait(DEADLINE)


def test_a_node_that_is_killed_is_given_up_long_before_the_default_of_fast_dds(
    world: Any, scenario_file: ScenarioFile, tmp_path: Path
) -> None:
    subscription = world.tester.create_subscription(
        MultiDOFJointState, "joint_state", lambda message: None, qos.LATEST
    )
    domain = world.tester.context.get_domain_id()
    node = start("simulator", domain, tmp_path / "log", "-p", f"scenario:={scenario_file('uu')}")
    try:
        world.until(subscription.get_publisher_count)
    finally:
        node.kill()
        node.wait(DEADLINE)
    killed = time.monotonic()
    world.until(lambda: not subscription.get_publisher_count())
    assert time.monotonic() - killed < GIVEN_UP
