"""The robot planner: which strategy it follows, and when."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot import Robot, some_state

from msg_adapters import diagnostics

RobotFactory = Callable[..., Robot]


@pytest.fixture
def make_robot(world: Any, wire: Any, scenario_file: Callable[..., Path]) -> RobotFactory:
    def make(kinds: str = "ud", **options: Any) -> Robot:
        return Robot(world, wire, scenario_file(kinds), **options)

    return make


@pytest.mark.parametrize("kinds", ["ud", "du"])
def test_lockstep_waits_for_the_strategy_of_the_same_step(
    kinds: str, make_robot: RobotFactory
) -> None:
    robot = make_robot(kinds)
    x = [some_state(robot, step) for step in range(3)]
    robot.see(0, x[0])
    robot.world.spin(0.1)
    assert not robot.controls
    first = robot.be_told(0)
    robot.wait(1)
    robot.see(1, x[1])
    robot.world.spin(0.1)
    assert len(robot.controls) == 1, "acted on a strategy of another step"
    second = robot.be_told(1)
    robot.wait(2)
    third = robot.be_told(2)  # this time the strategy comes first
    robot.world.spin(0.1)
    assert len(robot.controls) == 2
    robot.see(2, x[2])
    robot.wait(3)
    for step, told in enumerate((first, second, third)):
        found, inputs = robot.controls[step]
        assert found == step
        np.testing.assert_allclose(
            inputs[0], robot.reaction(told, step, x[step]), rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(inputs[1:], told.u_ref[1:], rtol=0, atol=1e-12)
    assert [status.values["strategy_age_steps"] for status in robot.reports] == ["0", "0", "0"]


def test_realtime_reacts_at_once_with_the_newest_strategy_while_its_horizon_lasts(
    make_robot: RobotFactory,
) -> None:
    robot = make_robot(time="realtime")
    told = robot.be_told(0, horizon=3)
    x = [some_state(robot, step) for step in range(6)]
    for step in range(3):
        robot.see(step, x[step])
        robot.wait(step + 1)
    robot.see(3, x[3])  # past the horizon
    robot.world.spin(0.1)
    assert len(robot.controls) == 3
    newer = robot.be_told(3, horizon=3)  # for the state that waits
    robot.wait(4)
    robot.see(5, x[5])
    robot.wait(5)
    for (found, inputs), step, used in zip(
        robot.controls, (0, 1, 2, 3, 5), (told, told, told, newer, newer), strict=True
    ):
        assert found == step
        np.testing.assert_allclose(
            inputs[0], robot.reaction(used, step, x[step]), rtol=0, atol=1e-12
        )
        # What is left of the plan bridges a gap.
        later = used.u_ref[step - robot.wire.clock.step(used.stamp) + 1 :]
        np.testing.assert_allclose(inputs[1:], later, rtol=0, atol=1e-12)
    ages = [status.values["strategy_age_steps"] for status in robot.reports]
    assert ages == ["0", "1", "2", "0", "2"]
    assert robot.reports[0].level == diagnostics.OK
    assert robot.reports[2].level == diagnostics.WARN


def test_realtime_acts_once_on_each_state(make_robot: RobotFactory) -> None:
    robot = make_robot(time="realtime")
    robot.be_told(0)
    robot.see(1, some_state(robot, 1))
    robot.wait(1)
    robot.be_told(1)  # news, but there is no state that waits
    robot.world.spin(0.1)
    assert len(robot.controls) == 1


def test_an_older_strategy_does_not_replace_a_newer_one(make_robot: RobotFactory) -> None:
    robot = make_robot(time="realtime")
    newer = robot.be_told(2)
    robot.be_told(1)
    x = some_state(robot, 3)
    robot.see(3, x)
    robot.wait(1)
    np.testing.assert_allclose(
        robot.controls[0][1][0], robot.reaction(newer, 3, x), rtol=0, atol=1e-12
    )
    assert robot.reports[0].values["rejected_messages"] == "1"


@pytest.mark.parametrize("length", [1, 3, 20])
def test_a_plan_is_as_long_as_it_may_be(length: int, make_robot: RobotFactory) -> None:
    robot = make_robot(plan_length=length)
    robot.be_told(0, horizon=5)
    robot.see(0, some_state(robot, 0))
    robot.wait(1)
    assert len(robot.controls[0][1]) == min(length, 5)


@pytest.mark.parametrize("kinds", ["ud", "du"])
def test_the_velocity_for_a_base_is_that_at_the_end_of_the_step(
    kinds: str, make_robot: RobotFactory
) -> None:
    robot = make_robot(kinds)
    x = some_state(robot, 0)
    robot.be_told(0)
    robot.see(0, x)
    robot.wait(1)
    u = robot.controls[0][1][0]
    dt = robot.scenario.dt
    velocity = robot.velocities[0]
    expected = (
        [x[3] + dt * u[1], 0.0, u[0]]
        if kinds == "ud"
        else [x[1] + dt * u[0], x[3] + dt * u[1], 0.0]
    )
    np.testing.assert_allclose(velocity, expected, rtol=0, atol=1e-12)


def test_a_node_in_a_namespace_uses_the_topics_of_that_namespace(make_robot: RobotFactory) -> None:
    robot = make_robot(namespace="/a")
    robot.be_told(0)
    robot.see(0, some_state(robot, 0))
    robot.wait(1)
    assert robot.reports[0].name == "/a/robot_planner"
    assert robot.world.tester.count_subscribers("/joint_state") == 0
    assert robot.world.tester.count_publishers("/robot/control") == 0


def test_topics_can_be_remapped(make_robot: RobotFactory) -> None:
    robot = make_robot(
        namespace="/a",
        state_topic="/elsewhere/states",
        cli_args=["--ros-args", "-r", "joint_state:=/elsewhere/states"],
    )
    robot.be_told(0)
    robot.see(0, some_state(robot, 0))
    robot.wait(1)
    assert robot.world.tester.count_subscribers("/a/joint_state") == 0


def test_a_heading_beyond_a_half_turn_is_that_of_the_scenario(
    world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> None:
    robot = Robot(world, wire, scenario_file("ud", heading=7.0))
    told = robot.be_told(0)
    x = robot.scenario.initial_state + 0.05
    robot.see(0, x)  # the wire says 7.05 - 2 pi
    robot.wait(1)
    np.testing.assert_allclose(
        robot.controls[0][1][0], robot.reaction(told, 0, x), rtol=0, atol=1e-12
    )
