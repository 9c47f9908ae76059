"""A base without a timeout comes to rest, however its planner ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
import yaml_text
from geometry_msgs.msg import TwistStamped
from node_of_its_own import NodeOfItsOwn
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from robot import Robot
from ros_context import ros_context
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from world import DEADLINE

from gameinfer_ros.games import ROBOT
from gameinfer_ros.nodes.base import spin
from gameinfer_ros.nodes.robot import commanded_base
from gameinfer_ros.nodes.robot.commanded_base import CommandedBase
from gameinfer_ros.nodes.robot.last_publisher import PATIENCE, last_publisher
from gameinfer_ros.nodes.robot_planner import LAST_COMMAND
from gameinfer_ros.scenario import Scenario
from msg_adapters import cmd_vel, qos

DT, LIMIT = 0.1, 1.0
#: The robot starts at 0.5 m/s and turns while it speeds up.
FAST = [[0.3, LIMIT]] * 10


@pytest.fixture
def scenario(scenario_file: ScenarioFile) -> Path:
    """A scenario in which the robot, a unicycle, brakes softly."""
    file = scenario_file("ud", dt=DT)
    content = yaml_text.load(file.read_text())
    content["players"]["robot"]["limits"] = {"a": [-LIMIT, LIMIT]}
    file.write_text(yaml_text.dump(content))
    return file


class Base:
    """A base that goes on with the last command, in a context of its own."""

    def __init__(self, context: rclpy.Context) -> None:
        self.commands: list[np.ndarray] = []
        self._node = Node("base", context=context)
        self._subscription = self._node.create_subscription(
            TwistStamped,
            "robot/cmd_vel",
            lambda m: self.commands.append(cmd_vel.decode(m, "robot")),
            qos.queued(qos.COMMAND),
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, self.commands[-3:]
            self.once()

    def once(self) -> None:
        self._executor.spin_once(timeout_sec=0.02)

    def drive(self, see: Callable[[int], None]) -> None:
        """Let the planner see states until a command arrives; it may not know the base at once."""
        for step in range(len(FAST)):
            see(step)
            end = time.monotonic() + 1.0
            while not self.commands and time.monotonic() < end:
                self.once()
            if self.commands:
                return
        raise AssertionError("the base gets no commands")

    @property
    def connected(self) -> bool:
        return self._subscription.get_publisher_count() > 0

    def check_rest(self, since: int) -> None:
        """Wait for rest, which it must be slowed down to within the limits."""
        self.until(lambda: not self.commands[-1].any())
        speeds = np.array(self.commands[since - 1 :])[:, 0]
        assert speeds[0] > 0.5, "it must move before"
        assert (np.diff(speeds) <= 1e-9).all() and (np.diff(speeds) >= -LIMIT * DT - 1e-9).all()


@pytest.fixture
def base_of() -> Iterator[Callable[[int], Base]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        contexts: list[Any] = []

        def make(domain: int) -> Base:
            contexts.append(ros_context(domain))
            return Base(contexts[-1].__enter__())

        yield make
        for context in contexts:
            context.__exit__(None, None, None)


def shut_down_by_a_signal(robot: Robot) -> None:
    # What rclpy's own handlers of signals do, without a word to the nodes.
    with robot.node.context.handle:
        robot.node.context.handle.shutdown()
    robot.node.close()


@pytest.mark.parametrize("time", ["realtime", "lockstep"])
@pytest.mark.parametrize(
    "end",
    [
        lambda robot: robot.node.close(),
        lambda robot: robot.world.remove(robot.node),
        lambda robot: robot.node.context.shutdown(),
        shut_down_by_a_signal,
    ],
    ids=["close", "destroy", "shutdown", "signal"],
)
def test_a_node_ends_with_zeros(
    end: Callable[[Robot], None],
    time: str,
    world: Any,
    wire: Any,
    scenario: Path,
    base_of: Callable[[int], Base],
) -> None:
    robot = Robot(world, wire, scenario, time=time)
    base = base_of(world.tester.context.get_domain_id())
    base.until(lambda: base.connected)

    def see(step: int) -> None:
        robot.be_told_to(step, FAST)
        robot.see(step, robot.scenario.initial_vehicle_state)

    base.drive(see)
    before = len(base.commands)
    end(robot)
    base.check_rest(before)


def test_missing_states_slow_the_base_down_in_lockstep_too(
    world: Any, wire: Any, scenario: Path
) -> None:
    robot = Robot(world, wire, scenario, time="lockstep", brake_after=0.2)
    robot.be_told_to(0, FAST)
    robot.see(0, robot.scenario.initial_vehicle_state)
    robot.wait(1)
    world.until(lambda: not robot.velocities[-1].any())
    assert len(robot.velocities) >= 6 and len(robot.controls) == 1


def test_a_base_that_cannot_stop_in_time_gets_zeros(
    scenario: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commanded_base, "STOPPING", 0.15)
    sent: list[np.ndarray] = []
    vehicles = Scenario.load(scenario).vehicles
    base = CommandedBase(vehicles, ROBOT, sent.append)
    base.stop()
    assert not sent, "a base that was not commanded is left alone"
    base.move(np.array([0.0, 0.0, 0.0, 100.0]), np.zeros(2))
    base.stop()
    assert 2 <= len(sent) <= 5 and sent[-2][0] > 99.0 and not sent[-1].any()
    base.stop()
    assert len(sent) <= 5


def test_a_base_whose_publisher_fails_resumes_with_another_one(scenario: Path) -> None:
    """A signal shuts the context down while a node is closed."""
    sent: list[float] = []

    def send(velocity: np.ndarray) -> None:
        if len(sent) == 3:
            raise RuntimeError("the context is invalid")
        sent.append(float(velocity[0]))

    base = CommandedBase(Scenario.load(scenario).vehicles, ROBOT, send)
    base.move(np.array([0.0, 0.0, 0.0, 0.5]), np.array([0.0, 0.0]))
    with pytest.raises(RuntimeError):
        base.stop(paced=False)
    sent.append(float(base.velocity[0]))  # as the other publisher repeats it
    base.stop(lambda velocity: sent.append(float(velocity[0])), paced=False)
    np.testing.assert_allclose(sent, [0.5, 0.4, 0.3, 0.2, 0.1, 0.0], atol=1e-9)


def test_a_long_time_step_does_not_delay_the_last_command(
    scenario: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A base that is still moving when its node is ended by force would keep moving."""
    monkeypatch.setattr(commanded_base, "STOPPING", 0.15)
    sent: list[np.ndarray] = []
    content = Scenario.load(scenario).model_dump() | {"dt": 10.0}
    vehicles = Scenario.model_validate(content).vehicles
    base = CommandedBase(vehicles, ROBOT, sent.append)
    base.move(np.array([0.0, 0.0, 0.0, 1e4]), np.zeros(2))
    begin = time.monotonic()
    base.stop()
    assert time.monotonic() - begin < 5.0
    assert not sent[-1].any()


def test_the_last_command_is_sent_before_a_node_is_ended_by_force() -> None:
    assert commanded_base.STOPPING < LAST_COMMAND < spin.END - PATIENCE


def test_the_last_publisher_is_heard_before_it_is_used(
    world: Any, base_of: Callable[[int], Base]
) -> None:
    domain = world.tester.context.get_domain_id()
    base, before = base_of(domain), cmd_vel.encode(0, np.array([0.6, 0.0, 0.0]), "robot")
    publisher = world.publisher(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    with last_publisher(publisher, 1, domain, lambda: before, 10.0) as publish:
        base.once()
        assert base.commands and base.commands[0][0] == 0.6
        publish(cmd_vel.encode(0, np.zeros(3), "robot"))
        base.until(lambda: not base.commands[-1].any())


# In processes of their own

#: Ends as a user's script may: with an exception in a callback, or without a word to the node.
SCRIPT = """
import sys
import rclpy
from gameinfer_ros.nodes.robot_planner import RobotPlanner
if sys.argv[1] == "raises":
    from gameinfer_ros.nodes.base import spin
    def fail(self):
        if self._base.moving:
            raise ArithmeticError("in a callback")
    RobotPlanner._watch = fail
    sys.exit(spin.spin(RobotPlanner))
from rclpy.signals import SignalHandlerOptions
rclpy.init(signal_handler_options=getattr(SignalHandlerOptions, sys.argv[2]))
rclpy.spin(RobotPlanner())
"""

#: Of a user's script: the signal, and the signals that rclpy handles there.
OF_A_USER = [
    f"user's {name} {handled}"
    for name, handled in (
        *((name, "ALL") for name in ("SIGINT", "SIGTERM", "SIGHUP")),
        *((name, "NO") for name in ("SIGINT", "SIGTERM", "SIGHUP")),
        ("SIGTERM", "SIGINT"),
        ("SIGINT twice", "ALL"),
        ("SIGHUP twice", "ALL"),
    )
]


@pytest.mark.parametrize("end", ["SIGINT", "SIGTERM", "SIGHUP", "raises", *OF_A_USER])
def test_a_process_ends_with_zeros(
    end: str, world: Any, wire: Any, scenario: Path, base_of: Callable[[int], Base], tmp_path: Path
) -> None:
    domain = world.tester.context.get_domain_id()
    arguments = ["--ros-args", "-p", f"scenario:={scenario}", "-p", "time:=realtime"]
    arguments += ["-p", "safety:=false", "-p", "brake_after:=60.0", "-p", "max_strategy_age:=60.0"]
    log = tmp_path / "log"
    if end.startswith("SIG"):
        process = NodeOfItsOwn("robot_planner", log, domain, *arguments).process
    else:
        script = ["-c", SCRIPT, end, end.split()[-1]]
        with log.open("wb") as file:
            process = subprocess.Popen(
                [sys.executable, *script, *arguments],
                env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
                start_new_session=True,
            )
    try:
        base, messages = base_of(domain), wire(Scenario.load(scenario))
        states = world.states()
        strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.LATEST)
        base.until(lambda: base.connected)
        world.send(strategies, messages.strategy(0, FAST))
        x0 = Scenario.load(scenario).initial_vehicle_state
        base.drive(lambda step: world.send(states, messages.state(step, x0)))
        before = len(base.commands)
        if end != "raises":
            number = getattr(signal, end.removeprefix("user's ").split()[0])
            process.send_signal(number)
            if "twice" in end:
                base.until(lambda: len(base.commands) > before)
                process.send_signal(number)
        try:
            base.check_rest(before)
        except AssertionError as error:
            raise AssertionError(log.read_text()) from error
        code = process.wait(DEADLINE)
        assert (code == 0) == end.startswith("SIG"), log.read_text()
        assert ("ArithmeticError" in log.read_text()) == (end == "raises")
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
