"""What keeps a robot from harm when something is late, lost, or wrong."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped
from rclpy.parameter import Parameter
from robot import Robot
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from wire import START

from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos, stamp

DT, LIMIT = 0.1, 1.0
RobotFactory = Callable[..., Robot]


@pytest.fixture
def limited(scenario_file: ScenarioFile) -> Callable[..., Path]:
    """Writes scenarios in which the robot brakes softly."""

    def write(kinds: str, **options: Any) -> Path:
        file = scenario_file(kinds, dt=DT, **options)
        content = yaml_text.load(file.read_text())
        inputs = ("ax", "ay") if kinds[0] == "d" else ("a",)
        content["players"]["robot"]["limits"] = {name: [-LIMIT, LIMIT] for name in inputs}
        file.write_text(yaml_text.dump(content))
        return file

    return write


@pytest.fixture
def make_robot(world: Any, wire: Any, limited: Callable[..., Path]) -> RobotFactory:
    def make(kinds: str = "uu", time: str = "realtime", **options: Any) -> Robot:
        return Robot(world, wire, limited(kinds, horizon=100), time=time, **options)

    return make


def some_state(robot: Robot, speed: float = 0.5, ahead: float = 20.0) -> np.ndarray:
    """The robot drives along x from 0 on, towards a person who stands there."""
    return np.array([0.0, 0.0, 0.0, speed, ahead, 0.0, 0.0, 0.0])


def assert_slows_down_within_limits(velocities: list[np.ndarray]) -> None:
    for before, after in pairwise(velocities):
        slower = before[:2] - after[:2]
        assert (slower >= -1e-9).all() and (slower <= LIMIT * DT + 1e-9).all()


@pytest.mark.parametrize("kinds", ["ud", "du"])
def test_without_states_a_base_slows_down_within_limits_and_then_stands(
    kinds: str, make_robot: RobotFactory
) -> None:
    robot = make_robot(kinds, brake_after=2.0)
    robot.be_told_to(0, np.zeros((20, 2)))
    robot.see(0, robot.scenario.initial_vehicle_state)  # at 0.5 m/s
    robot.world.until(lambda: robot.velocities and not robot.velocities[-1].any())
    robot.world.until(lambda: len(robot.velocities) > 9, "the base gets only one zero velocity")
    velocities = robot.velocities
    np.testing.assert_allclose(velocities[0], [0.5, 0.0, 0.0], atol=1e-12)
    assert_slows_down_within_limits(velocities)
    # As hard as the limits allow: there are five steps from 0.5 m/s to rest.
    assert not velocities[5].any() and velocities[4].any()
    assert any("brakes: no joint_state for" in r.message for r in robot.reports)
    assert robot.reports[-1].level == diagnostics.WARN
    # Bases compare stamps with their own clock.
    sent = stamp.decode(robot._velocities[-1].header.stamp)
    assert abs(1e-9 * (sent - robot.node.get_clock().now().nanoseconds)) < 60.0


def test_a_strategy_that_is_too_old_is_not_followed_until_there_is_a_newer_one(
    make_robot: RobotFactory, capfd: pytest.CaptureFixture[str]
) -> None:
    robot = make_robot(max_strategy_age=5.35, brake_after=60.0)
    robot.be_told_to(4, [[0.1, 0.2]] * 100)
    for count, step in enumerate((4, 24, 49), 1):
        robot.see(step, some_state(robot))
        robot.wait(count)
        np.testing.assert_allclose(robot.controls[-1][1][0], [0.1, 0.2], atol=1e-12)
    # What bridges a gap is not older either.
    assert [len(inputs) for _, inputs in robot.controls[:2]] == [10, 10]
    assert 1 <= len(robot.controls[2][1]) <= 9
    robot.see(58, some_state(robot))
    robot.wait(4)
    step, inputs = robot.controls[3]
    assert step == 58
    np.testing.assert_allclose(inputs, [[0.0, -LIMIT]], atol=1e-12)
    np.testing.assert_allclose(robot.velocities[3], [0.4, 0.0, 0.0], atol=1e-12)
    assert robot.reports[3].message.startswith("brakes: the newest strategy is")
    assert robot.reports[3].level == diagnostics.WARN
    robot.be_told_to(54, [[0.3, 0.0]] * 20)  # for the state that waits
    robot.world.until(lambda: any(r.message.startswith("follows") for r in robot.reports[4:]))
    step, inputs = robot.controls[-1]
    assert step == 58
    np.testing.assert_allclose(inputs[0], [0.3, 0.0], atol=1e-12)
    log = capfd.readouterr().err
    assert "brakes: the newest strategy is" in log and "robot resumes at step 58" in log


def test_a_strategy_gets_too_old_between_states_too(make_robot: RobotFactory) -> None:
    robot = make_robot(max_strategy_age=0.3, brake_after=60.0)
    robot.be_told_to(0, np.zeros((20, 2)))
    robot.see(2, some_state(robot))
    robot.world.until(lambda: robot.velocities and not robot.velocities[-1].any())
    assert_slows_down_within_limits(robot.velocities)
    assert any("brakes: the newest strategy is" in r.message for r in robot.reports)


def test_a_state_that_waited_for_too_long_is_not_reacted_to(make_robot: RobotFactory) -> None:
    robot = make_robot(brake_after=0.3)
    robot.be_told_to(0, np.zeros((20, 2)))
    robot.show(0, some_state(robot))
    time.sleep(0.7)  # the node does not spin
    robot.world.until(lambda: robot.controls and robot.reports)
    np.testing.assert_allclose(robot.controls[0][1], [[0.0, -LIMIT]], atol=1e-12)
    assert robot.reports[0].message.startswith("brakes: no strategy for the state of step 0 for")
    assert not robot.velocities, "the speed of the base is unknown"


def test_what_was_kept_for_those_who_join_late_is_as_old_as_it_is(
    world: Any, wire: Any, limited: Callable[..., Path]
) -> None:
    file = limited("uu", horizon=100)
    wire = wire(Scenario.load(file))
    started = world.tester.create_publisher(Time, "run_start", qos.LATEST)
    started.publish(stamp.encode(START))
    kept = world.tester.create_publisher(MultiDOFJointState, "joint_state", qos.STREAM)
    told = world.tester.create_publisher(Float64MultiArray, "robot_strategy", qos.LATEST)
    told.publish(wire.strategy(5, np.full((20, 2), 0.3)))
    kept.publish(wire.state(5, np.array([0.0, 0.0, 0.0, 0.5, 20.0, 0.0, 0.0, 0.0])))
    time.sleep(0.7)
    velocities = world.hear(TwistStamped, "robot/cmd_vel", qos.queued(qos.COMMAND), senders=0)
    controls = world.hear(MultiDOFJointTrajectory, "robot/control", qos.STREAM, senders=0)
    world.add(RobotPlanner, scenario=file, time="realtime", brake_after=0.5)
    world.until(lambda: controls)
    np.testing.assert_allclose(wire.read_control("robot", controls[0])[1], [[0.0, -LIMIT]])
    world.spin(0.5)
    assert not velocities
    kept.publish(wire.state(12, np.array([0.7, 0.0, 0.0, 0.5, 20.0, 0.0, 0.0, 0.0])))
    world.until(lambda: velocities)


def test_a_late_strategy_does_not_move_a_base_that_has_come_to_rest(
    make_robot: RobotFactory,
) -> None:
    robot = make_robot(brake_after=2.0)
    robot.be_told_to(0, np.zeros((5, 2)))
    robot.see(0, some_state(robot))
    robot.see(7, some_state(robot))  # which that strategy does not reach
    robot.world.until(lambda: robot.velocities and not robot.velocities[-1].any())
    assert_slows_down_within_limits(robot.velocities)
    done = len(robot.controls)
    robot.be_told_to(7, [[0.0, 1.0]] * 20)
    robot.world.until(lambda: len(robot.controls) > done)
    np.testing.assert_allclose(robot.controls[-1][1], [[0.0, -LIMIT]], atol=1e-12)
    robot.world.spin(0.5)
    assert_slows_down_within_limits(robot.velocities)
    assert not robot.velocities[-1].any()


def test_ages_do_not_matter_in_lockstep(make_robot: RobotFactory) -> None:
    robot = make_robot(time="lockstep", brake_after=0.05, max_strategy_age=0.05)
    robot.be_told_to(0, [[0.1, 0.2]] * 20)
    robot.show(0, some_state(robot))
    time.sleep(0.2)
    robot.wait(1)
    np.testing.assert_allclose(robot.controls[0][1], [[0.1, 0.2]] * 10, atol=1e-12)


@pytest.mark.parametrize("no_number", [np.nan, np.inf, 1e300])
def test_strategies_that_are_no_numbers_are_refused_and_the_robot_brakes(
    no_number: float, make_robot: RobotFactory
) -> None:
    robot = make_robot(max_strategy_age=3.05, brake_after=60.0)
    robot.be_told_to(0, [[0.1, 0.2]] * 100)
    for count, step in enumerate((0, 5, 10, 31), 1):
        if step > 0:
            robot.be_told_to(step, [[no_number, 0.0]] * 100)
        robot.see(step, some_state(robot))
        robot.wait(count)
    first = [inputs[0] for _, inputs in robot.controls]
    np.testing.assert_allclose(first[0], [0.1, 0.2], atol=1e-12)
    np.testing.assert_allclose(first[3], [0.0, -LIMIT], atol=1e-12)
    assert robot.reports[3].values["rejected_messages"] == "3"
    assert robot.reports[3].message.startswith("brakes: the newest strategy is")


def test_the_safety_layer_stops_a_robot_that_drives_at_a_person_and_reports_it(
    make_robot: RobotFactory, capfd: pytest.CaptureFixture[str]
) -> None:
    robot = make_robot(time="lockstep", safety=True)
    for step, speed in enumerate((0.5, 0.4)):
        robot.be_told_to(step, [[0.0, 0.9]] * 20)
        robot.see(step, some_state(robot, speed, ahead=0.65))
        robot.wait(step + 1)
    assert [step for step, _ in robot.controls] == [0, 1]
    for _, inputs in robot.controls:
        np.testing.assert_allclose(inputs, [[0.0, -LIMIT]], atol=1e-12)
    np.testing.assert_allclose(np.array(robot.velocities)[:, 0], [0.4, 0.3], atol=1e-12)
    for report in robot.reports:
        assert report.message.startswith("the safety layer brakes: the input leaves 0.")
        assert "m to human_1 within" in report.message
        assert report.level == diagnostics.WARN and report.values["safety"] == "brakes"
    assert robot.reports[-1].values["safety_braked"] == "2"
    assert "the safety layer brakes: the input leaves 0." in capfd.readouterr().err
    robot.node.set_parameters([Parameter("safety", value=False)])
    robot.be_told_to(2, [[0.0, 0.9]] * 20)
    robot.see(2, some_state(robot, 0.3, ahead=0.65))
    robot.wait(3)
    np.testing.assert_allclose(robot.controls[2][1][0], [0.0, 0.9], atol=1e-12)
    assert robot.reports[-1].values["safety"] == "off"


def test_the_safety_layer_reports_that_it_does_not_brake_because_braking_is_worse(
    make_robot: RobotFactory,
) -> None:
    """A person is about to cross where the robot would come to rest."""
    robot = make_robot(time="lockstep", safety=True)
    robot.be_told_to(0, [[0.0, LIMIT]] * 20)
    robot.see(0, np.array([0.0, 0.0, 0.0, 1.0, 0.6, 1.35, -np.pi / 2, 1.5]))
    robot.wait(1)
    np.testing.assert_allclose(robot.controls[0][1], [[0.0, LIMIT]], atol=1e-12)
    robot.world.until(lambda: any("safety" in report.values for report in robot.reports))
    report = next(report for report in robot.reports if "safety" in report.values)
    assert report.message.startswith("the safety layer does not brake: braking leaves 0.")
    assert report.level == diagnostics.WARN and report.values["safety"] == "goes on"
    assert report.values["safety_braked"] == "0"


def test_the_safety_layer_cuts_off_inputs_and_plans(make_robot: RobotFactory) -> None:
    robot = make_robot(time="lockstep", safety=True)
    robot.be_told_to(0, [[0.2, 7.0]] * 20)
    robot.see(0, some_state(robot))
    robot.wait(1)
    np.testing.assert_allclose(robot.controls[0][1], [[0.2, LIMIT]] * 10, atol=1e-12)
    assert robot.reports[0].message == "the safety layer limits the input: a 7.00 is clipped to 1"
    assert robot.reports[0].values["safety_limited"] == "1"
    robot.be_told_to(1, [[0.0, 0.0]] * 20)
    robot.see(1, some_state(robot, 0.5, ahead=1.0))  # 0.5 m before the clearance, 0.125 m to stop
    robot.wait(2)
    inputs = robot.controls[1][1]
    assert 4 <= len(inputs) < 10 and not inputs.any(), "the tail ends where it is safe"
    assert robot.reports[1].values["safety"] == "passes"
    robot.start_run()
    robot.be_told_to(0, [[0.0, 0.0]] * 20)
    robot.see(0, some_state(robot))
    robot.wait(3)
    assert robot.reports[2].values["safety_limited"] == "0"
