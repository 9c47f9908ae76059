"""What the nodes make of cars, whose steering the pose and the rates of the body do not tell."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray
from wire import START

from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario
from msg_adapters import cmd_vel, equilibrium, markers, qos, strategy

JOINTS = ["robot", "human_1", "robot/steering"]


@pytest.fixture
def file(scenario_file: Callable[..., Path]) -> Path:
    """A car as robot and a unicycle as human."""
    return scenario_file("cu", steps=3, dt=0.2)


@pytest.fixture
def scenario(file: Path) -> Scenario:
    return Scenario.load(file)


def test_the_simulator_tells_and_is_told_the_steering(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    simulator, vehicles = world.add(Simulator, scenario=file), scenario.vehicles
    wire = wire(scenario, simulator.clock)
    hands = {
        name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        for name in ("robot", "human_1")
    }
    heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    s, w = scenario.initial_vehicle_state, np.array([0.7, -2.5, 0.1, 0.3])  # the car stops
    for step in range(3):
        world.until(lambda step=step: len(heard) > step)
        assert heard[step].joint_names == JOINTS
        np.testing.assert_allclose(wire.read_state(heard[step]), s, rtol=0, atol=1e-12)
        message = wire.control("robot", step, w[:2])
        assert message.joint_names == ["robot", "robot/steering"]
        world.send(hands["robot"], message)
        world.send(hands["human_1"], wire.control("human_1", step, w[2:]))
        s = vehicles.step(s, w)
        w[1] = 0.0
    world.until(lambda: len(heard) == 4)
    found = wire.read_state(heard[3])
    np.testing.assert_allclose(found, s, rtol=0, atol=1e-12)
    # It stands, and yet its steering can be told.
    np.testing.assert_allclose(found[3:5], [0.0, 0.1 + 3 * 0.2 * 0.7], rtol=0, atol=1e-12)


def test_a_silent_car_brakes_and_holds_its_steering(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    simulator = world.add(Simulator, scenario=file, time="realtime")
    wire = wire(scenario, simulator.clock)
    hands = {
        name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        for name in ("robot", "human_1")
    }
    heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: heard)
    world.send(hands["robot"], wire.control("robot", 0, [0.5, 0.0]))  # its last word
    world.send(hands["human_1"], wire.control("human_1", 0, [[0.0, 0.0]] * 3))
    world.until(lambda: len(heard) == 4)
    found = [wire.read_state(message)[3:5] for message in heard]
    expected = [[0.5, 0.1], [0.5, 0.2], [0.0, 0.2], [0.0, 0.2]]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_the_robot_is_a_car_for_its_plan_and_for_a_base(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    wire = wire(scenario)
    world.add(RobotPlanner, scenario=file)
    states = world.states()
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.LATEST)
    plans = world.hear(MultiDOFJointTrajectory, "robot/control", qos.STREAM)
    velocities = world.hear(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    u = np.array([[0.5, 1.0], [0.2, -1.0]])
    told = strategy.AffineStrategy(START, 0, u, np.zeros((2, 2, 9)), np.zeros((2, 9)))
    world.send(strategies, strategy.encode(told))
    world.send(states, wire.state(0, scenario.initial_vehicle_state))
    world.until(lambda: plans and velocities)
    _, inputs = wire.read_control("robot", plans[0])
    np.testing.assert_array_equal(inputs, u)
    velocity = cmd_vel.decode(velocities[0], "robot")
    # At the end of the step it does 0.5 + 0.2 * 1 m/s and steers by 0.1 + 0.2 * 0.5 rad.
    expected = [0.7, 0.0, 0.7 * np.tan(0.2) / 0.8]
    np.testing.assert_allclose(velocity, expected, rtol=0, atol=1e-12)


def test_viewers_are_shown_bodies_and_wheels(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    world.add(Inference, scenario=file, seed=3)
    states = world.states()
    paths = world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    drawn = world.hear(MarkerArray, "markers", qos.STREAM)
    told = world.hear(Float64MultiArray, "robot_strategy", qos.STREAM)
    world.send(states, wire(scenario).state(0, scenario.initial_vehicle_state))
    world.until(lambda: paths and drawn and told)
    arrows = [shape for shape in markers.decode(drawn[0]) if isinstance(shape, markers.Arrow)]
    np.testing.assert_allclose([a.pose for a in arrows], [[0, 0, 0], [0, 1, 0]], atol=1e-12)
    found = equilibrium.decode(paths[0], JOINTS)
    for k, x in enumerate(strategy.decode(told[0], 2, 9).x_ref):
        shown = scenario.vehicles.state(found.poses[k], found.twists[k])
        np.testing.assert_allclose(shown, x, rtol=0, atol=1e-9)
