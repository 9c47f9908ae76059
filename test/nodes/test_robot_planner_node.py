"""The robot planner: which strategy it follows, and when."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from robot import Robot, some_state
from small_scenario import ScenarioFile

from msg_adapters import diagnostics

RobotFactory = Callable[..., Robot]


@pytest.fixture
def make_robot(world: Any, wire: Any, scenario_file: ScenarioFile) -> RobotFactory:
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
    robot.be_told(1)  # a newer one, but no state waits
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


def test_the_planner_survives_a_state_that_is_far_away(make_robot: RobotFactory) -> None:
    robot = make_robot("uu")
    for step, far in enumerate((0.0, 1e11, 0.0)):
        robot.be_told(step)
        robot.see(step, some_state(robot, step) + far)
        robot.wait(step + 1)
    assert [step for step, _ in robot.controls] == [0, 1, 2]


@pytest.mark.parametrize("length", [1, 3, 20])
def test_a_plan_is_as_long_as_it_may_be(length: int, make_robot: RobotFactory) -> None:
    robot = make_robot(plan_length=length)
    robot.be_told(0, horizon=5)
    robot.see(0, some_state(robot, 0))
    robot.wait(1)
    assert len(robot.controls[0][1]) == min(length, 5)


@pytest.mark.parametrize(
    ("kinds", "u", "velocity"),
    [
        ("ud", [0.4, 2.0], [0.7, 0.0, 0.4]),
        ("du", [2.0, -3.0], [0.7, -0.3, 0.0]),
        # From a standstill it turns by 0.5 rad within the step, and is 2 m/s^2 * 0.1 s fast then.
        ("ff", [2.0 * np.cos(0.5), 2.0 * np.sin(0.5)], [0.2, 0.0, 5.0]),
        ("cu", [0.5, 1.0], [0.6, 0.0, 0.6 * np.tan(0.1 + 0.1 * 0.5) / 0.8]),
    ],
)
def test_the_velocity_for_a_base_is_that_of_the_vehicle_at_the_end_of_the_step(
    kinds: str, u: list[float], velocity: list[float], make_robot: RobotFactory
) -> None:
    robot = make_robot(kinds)
    robot.be_told_to(0, [u, u])
    robot.see(0, robot.scenario.initial_vehicle_state)
    robot.wait(1)
    np.testing.assert_allclose(robot.velocities[0], velocity, rtol=0, atol=1e-9)
    if kinds == "cu":  # the control has a joint for the steering
        np.testing.assert_array_equal(robot.controls[0][1], [u, u])


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
