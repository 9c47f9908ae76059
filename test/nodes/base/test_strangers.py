"""Messages of unexpected publishers move no player; when they are gone, all continue."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arena import Arena
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from node_of_its_own import NodeOfItsOwn
from rclpy.node import Node
from rclpy.publisher import Publisher
from robot import Robot, some_state
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from table import Table
from trajectory_msgs.msg import MultiDOFJointTrajectory
from wire import START

from gameinfer_ros.nodes.base import middleware
from gameinfer_ros.nodes.base.sole_subscription import SoleSubscription
from gameinfer_ros.nodes.human_agent import HumanAgent
from msg_adapters import diagnostics, qos, stamp

#: Fast DDS gives up a process that was killed after 3 s if it is told so, and after 20 s if not.
GIVEN_UP = 15.0


class Stranger:
    """An unexpected node that publishes what others do."""

    def __init__(self, world: Any) -> None:
        self._world = world
        self._node = Node("stranger", context=world.tester.context)

    def publisher(self, message_type: Any, topic: str, profile: Any = qos.STREAM) -> Publisher:
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
def test_the_robot_brakes_while_another_node_publishes_and_then_resumes(
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
    robot.see(3, some_state(robot, 3))  # lockstep: it is not repeated
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
    table = Table(world, wire, scenario_file("uu", steps=1000))
    table.wait(0)
    # Only the players of the scenario have topics.
    topics = {name for name, _ in table.node.get_topic_names_and_types() if "control" in name}
    assert topics == {"/robot/control", "/human_1/control"}
    other = stranger.publisher(MultiDOFJointTrajectory, "human_1/control")
    table.play("robot", 0, [0.1, 0.2])
    for _ in range(5):
        world.send(other, table.wire.control("human_1", 0, [9.0, 9.0]))
    table.play("human_1", 0, [0.3, 0.4])
    world.spin(0.5)
    assert table.node.world.step == 0
    stranger.leave()
    table.wait(1)
    expected = table.game.step(table.scenario.initial_state, np.array([0.1, 0.2, 0.3, 0.4]))
    np.testing.assert_allclose(table.states[-1], expected, atol=1e-9)


def test_odometry_of_a_stranger_moves_no_external_player(
    world: Any, wire: Any, scenario_file: ScenarioFile, stranger: Stranger
) -> None:
    arena = Arena(world, wire, scenario_file("uu", steps=30), "human_1", odom_timeout=0.45)
    arena.begin("human_1")
    arena.go("human_1", 0.1)
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
    arena.go("human_1", 0.9)
    world.until(lambda: 9 in arena.states)


@pytest.fixture
def start(world: Any, tmp_path: Path) -> Iterator[Callable[..., NodeOfItsOwn]]:
    """Starts nodes that get no settings for the middleware, in the domain of the world."""
    own = (middleware.FAST_DDS, middleware.RANGE)
    environment = {k: v for k, v in os.environ.items() if k not in own}
    domain, nodes = world.tester.context.get_domain_id(), list[NodeOfItsOwn]()

    def make(module: str, *parameters: str) -> NodeOfItsOwn:
        arguments = ["--ros-args", *(word for p in parameters for word in ("-p", p))]
        log = tmp_path / f"{len(nodes)}.log"
        nodes.append(NodeOfItsOwn(module, log, domain, *arguments, environment=environment))
        return nodes[-1]

    yield make
    for node in nodes:
        node.process.send_signal(signal.SIGINT)
    for node in nodes:
        node.exit_code()


def test_a_simulator_that_is_killed_and_started_again_is_not_taken_for_two(
    world: Any, scenario_file: ScenarioFile, start: Callable[..., NodeOfItsOwn]
) -> None:
    settings = (f"scenario:={scenario_file('uu', steps=100_000)}", "time:=realtime")
    stamps: list[int] = []

    def note(message: MultiDOFJointState) -> None:
        stamps.append(stamp.decode(message.header.stamp))

    subscription = world.tester.create_subscription(
        MultiDOFJointState, "joint_state", note, qos.LATEST
    )
    starts = world.hear(Time, "run_start", qos.LATEST, senders=0)
    for module in ("inference", "robot_planner", "human_agent"):
        start(module, *settings)
    simulator = start("simulator", *settings)
    # On a busy machine only some of the states are seen.
    world.until(lambda: starts and stamps and stamps[-1] > stamps[0] + 2 * 10**9)
    simulator.process.kill()
    killed = time.monotonic()
    start("simulator", *settings)
    world.until(lambda: len(starts) > 1)  # the second one has begun
    # It continues only if both players have answered to its first state.
    world.until(lambda: stamps[-1] > stamp.decode(starts[-1]))
    world.until(lambda: subscription.get_publisher_count() == 1)
    assert time.monotonic() < killed + GIVEN_UP + 30.0


def test_a_node_that_is_killed_is_given_up_long_before_the_default_of_fast_dds(
    world: Any, scenario_file: ScenarioFile, start: Callable[..., NodeOfItsOwn]
) -> None:
    subscription = world.tester.create_subscription(
        MultiDOFJointState, "joint_state", lambda message: None, qos.LATEST
    )
    node = start("simulator", f"scenario:={scenario_file('uu')}")
    world.until(subscription.get_publisher_count)
    node.end()
    killed = time.monotonic()
    world.until(lambda: not subscription.get_publisher_count())
    assert time.monotonic() - killed < GIVEN_UP
