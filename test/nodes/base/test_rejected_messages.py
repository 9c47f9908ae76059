"""No message, however malformed, stops a node; the good ones that follow still count."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos, strategy

NAN = float("nan")
Edit = Callable[[Any], object]


def nan_position(message: MultiDOFJointState) -> None:
    message.transforms[0].translation.x = NAN


def no_rotation(message: MultiDOFJointState) -> None:
    message.transforms[1].rotation = Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)


def between_steps(message: Any) -> None:
    message.header.stamp.nanosec += 12_345


def before_the_start(message: Any) -> None:
    message.header.stamp.sec = -1


def nan_rate(message: MultiDOFJointTrajectory) -> None:
    message.points[0].velocities[0].angular.z = NAN


def infinite_acceleration(message: MultiDOFJointTrajectory) -> None:
    message.points[-1].accelerations[0].linear.x = float("inf")


def put(field: str, value: Any) -> Edit:
    return lambda message: setattr(message, field, value)


def put_number(i: int, value: float) -> Edit:
    return lambda message: message.data.__setitem__(i, value)


def other_label(message: Float64MultiArray) -> None:
    message.layout.dim[1].label = "u_ref[3] P[3x8] x_ref[8]"


def no_steps(message: Float64MultiArray) -> None:
    message.layout.dim[0].size = 0
    message.data = message.data[:3]


def as_it_was(message: Any) -> None:
    """A message that came before, and is stale now."""


BAD_STATES: list[Edit] = [
    put("joint_names", ["human_1", "robot"]),
    put("joint_names", []),
    put("transforms", []),
    put("twist", []),
    put("wrench", []),
    nan_position,
    no_rotation,
    between_steps,
    before_the_start,
    as_it_was,
]
BAD_CONTROLS: list[Edit] = [
    put("joint_names", ["robot"]),
    put("joint_names", []),
    put("points", []),
    nan_rate,
    infinite_acceleration,
    between_steps,
    before_the_start,
]
BAD_STRATEGIES: list[Edit] = [
    put("data", []),
    put_number(0, NAN),
    put_number(0, 12345.0),
    put_number(1, 987654321.0),
    put_number(2, NAN),
    put_number(5, NAN),
    put_number(-1, float("inf")),
    other_label,
    no_steps,
    as_it_was,
]


class Patient:
    """A node that is to survive, between good messages and bad ones."""

    def __init__(self, world: Any, wire: Any, node: GameNode) -> None:
        self.world, self.node, self.scenario = world, node, node.scenario
        self.wire, self.step = wire(node.scenario), 0
        if isinstance(node, Simulator):
            self.wire = wire(node.scenario, node.clock)
        self.reports: list[diagnostics.NodeStatus] = world.reports(node)
        self.states = None
        if not isinstance(node, Simulator):
            self.states = world.states()
        self.strategies = None
        if isinstance(node, RobotPlanner):
            self.strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.LATEST)
        self.controls = {}
        if isinstance(node, Simulator):
            self.controls = {
                name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
                for name in node.players.names
            }

    def state(self, step: int) -> MultiDOFJointState:
        return self.wire.state(step, self.scenario.initial_state)

    def strategy(self, step: int) -> Float64MultiArray:
        horizon, nx = 5, self.node.players.n_states
        return strategy.encode(
            strategy.AffineStrategy(
                self.wire.clock.stamp(step),
                0,
                np.zeros((horizon, 2)),
                np.zeros((horizon, 2, nx)),
                np.zeros((horizon, nx)),
            )
        )

    def go_on(self) -> diagnostics.NodeStatus:
        """Make a step with good messages; returns what the node says of itself then."""
        if self.states is not None:
            self.world.send(self.states, self.state(self.step))
        if self.strategies is not None:
            self.world.send(self.strategies, self.strategy(self.step))
        for name, publisher in self.controls.items():
            self.world.send(publisher, self.wire.control(name, self.step, [[0.1, 0.2]]))
        self.world.until(
            lambda: self.reports and self.reports[-1].values["step"] == str(self.step),
            f"nothing from {self.node.get_name()} about step {self.step}",
        )
        self.step += 1
        return self.reports[-1]

    def until_rejected(self, count: int) -> None:
        """Wait until so many messages were rejected; one between two steps is kept for a while."""
        faults = self.node.topic_faults
        self.world.until(lambda: faults.rejected.total() == count)


PatientFactory = Callable[..., Patient]


@pytest.fixture
def make_patient(
    world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> Iterator[PatientFactory]:
    def make(kind: type, **parameters: Any) -> Patient:
        file = scenario_file("uu", steps=1000)
        return Patient(world, wire, world.add(kind, scenario=file, **parameters))

    yield make


@pytest.mark.parametrize("kind", [Inference, RobotPlanner, HumanAgent])
@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_a_node_survives_malformed_states(
    kind: type, time: str, make_patient: PatientFactory
) -> None:
    patient = make_patient(kind, time=time)
    assert patient.go_on().values["rejected_messages"] == "0"
    for count, edit in enumerate(BAD_STATES, 1):
        # Made from the state that came before, so that it is stale where it is not edited.
        message = patient.state(patient.step - (edit is as_it_was))
        edit(message)
        patient.world.send(patient.states, message)
        patient.until_rejected(count)
        assert patient.go_on().values["rejected_messages"] == str(count), edit


@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_the_planner_survives_malformed_strategies(time: str, make_patient: PatientFactory) -> None:
    patient = make_patient(RobotPlanner, time=time)
    assert patient.go_on().values["rejected_messages"] == "0"
    for count, edit in enumerate(BAD_STRATEGIES, 1):
        message = patient.strategy(patient.step - (edit is as_it_was))
        edit(message)
        patient.world.send(patient.strategies, message)
        patient.until_rejected(count)
        assert patient.go_on().values["rejected_messages"] == str(count), edit


def test_the_simulator_survives_malformed_controls(make_patient: PatientFactory) -> None:
    patient = make_patient(Simulator)
    started = patient.world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    patient.world.until(lambda: started)
    assert patient.go_on().values["rejected_messages"] == "0"
    for count, edit in enumerate(BAD_CONTROLS, 1):
        message = patient.wire.control("human_1", patient.step, [[9.0, 9.0]] * 2)
        edit(message)
        patient.world.send(patient.controls["human_1"], message)
        assert patient.go_on().values["rejected_messages"] == str(count), edit
    # Nothing of the malformed messages has moved anybody.
    heard = patient.world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    patient.world.until(lambda: len(heard) > patient.step)
    x = patient.scenario.initial_state
    for _ in range(patient.step):
        x = patient.scenario.game.step(x, np.array([0.1, 0.2, 0.1, 0.2]))
    np.testing.assert_allclose(patient.wire.read_state(heard[-1]), x, rtol=0, atol=1e-9)


def test_the_recorder_survives_malformed_messages(
    world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> None:
    file = scenario_file("uu")
    scenario = Scenario.load(file)
    recorder = world.add(Recorder, scenario=file)
    states = world.states()
    beliefs = world.publisher(Float64MultiArray, "belief", qos.STREAM)
    for step in range(3):
        for edit in (nan_position, put("twist", []), between_steps):
            message = wire(scenario).state(step, scenario.initial_state)
            edit(message)
            world.send(states, message)
        world.send(beliefs, Float64MultiArray())
        world.send(states, wire(scenario).state(step, scenario.initial_state + 0.1 * step))
    world.until(lambda: len(recorder.record.states) == 3)
    np.testing.assert_allclose(recorder.record.states[2], scenario.initial_state + 0.2, atol=1e-12)
    assert recorder.record.beliefs == {}


@pytest.mark.parametrize("kind", [Inference, RobotPlanner, HumanAgent])
def test_a_node_survives_a_state_far_from_all_it_knows(
    kind: type, make_patient: PatientFactory
) -> None:
    patient = make_patient(kind)
    patient.go_on()
    far = patient.scenario.initial_state + 1e11
    patient.world.send(patient.states, patient.wire.state(patient.step, far))
    if patient.strategies is not None:
        patient.world.send(patient.strategies, patient.strategy(patient.step))
    patient.world.until(lambda: len(patient.reports) == 2)
    patient.step += 1
    assert patient.go_on().values["step"] == "2"
