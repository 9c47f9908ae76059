"""A node goes on whatever it is sent, counts it, and is as before afterwards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bad_messages import cut_off, mutated
from nodes_room import LISTENERS, Run, memory, topics
from rcl_interfaces.srv import GetParameters
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.base.step_order import AHEAD, CONFIRMED
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.scenario import Scenario
from msg_adapters import belief, qos, strategy

STEPS = 12
ScenarioFile = Callable[..., Path]


def good(topic: str, message_type: Any, scenario: Scenario, wire: Any) -> Any:
    """A message that a node can use, where the topic is known; else an empty one."""
    name, nx = topic.rpartition("/")[2], scenario.game.players.n_states
    if name == "joint_state":
        return wire(scenario).state(1, scenario.initial_vehicle_state)
    if name == "control":
        return wire(scenario).control(topic.split("/")[-2], 0, [[0.1, 0.2]] * 3)
    if name == "robot_strategy":
        zeros = np.zeros((5, 2)), np.zeros((5, 2, nx)), np.zeros((5, nx))
        return strategy.encode(strategy.AffineStrategy(1, 0, *zeros), scenario.dt)
    if name == "belief":
        ones = np.ones(3)
        summary = belief.BeliefSummary(1, 0, np.arange(3), ones / 3, ones > 0, np.ones((3, 2)))
        return belief.encode(summary, scenario.dt)
    return message_type()


def answers(world: Any, node: Any) -> bool:
    """Whether a node answers a service."""
    name = f"{node.get_fully_qualified_name()}/get_parameters"
    client = world.tester.create_client(GetParameters, name)
    world.until(client.service_is_ready, f"nobody serves {name}")
    future = client.call_async(GetParameters.Request(names=["scenario"]))
    world.until(future.done, f"{name} does not answer")
    return bool(future.result().values[0].string_value)


@pytest.mark.parametrize("who", LISTENERS)
def test_whatever_comes_on_a_topic_the_node_goes_on(
    who: str, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    make, parameters = LISTENERS[who]
    file, rng = scenario_file("uu", steps=1000), np.random.default_rng(0)
    node = world.add(make, scenario=file, **parameters)
    every = list(topics(node))
    assert every
    for topic, message_type, profile in every:
        message = good(topic, message_type, node.scenario, wire)
        publisher = world.publisher(message_type, topic, profile)
        for _ in range(25):
            publisher.publish(mutated(message, rng))
            world.spin()
        before = node.topic_faults.rejected.total()
        # Best effort may lose some.
        world.until(
            lambda publisher=publisher, message=message, before=before: (
                publisher.publish(cut_off(message)) or node.topic_faults.rejected.total() > before
            ),
            f"{topic}: what cannot be read is not counted",
        )
    assert answers(world, node)
    reports = world.reports(node)
    world.until(lambda: reports and int(reports[-1].values["rejected_messages"]) > 0)
    assert len(reports[-1].values["last_rejection"]) < 700


def test_in_lockstep_bad_messages_change_nothing_to_the_last_bit(
    make_world: Any, scenario_file: ScenarioFile
) -> None:
    file = scenario_file("uu", steps=STEPS)
    quiet = Run(make_world(), file, STEPS, listeners=5)
    quiet.listen()
    quiet.world.until(lambda: quiet.done)
    assert all(len(messages) >= STEPS for messages in quiet.heard.values())

    for seed in range(2):
        rng = np.random.default_rng(seed)
        loud, spoiled_at = Run(make_world(), file, STEPS), 0
        while not loud.done:
            step = len(loud.recorder.record.states) - 1
            if step > spoiled_at and step >= 4:
                loud.spoil(quiet.heard, step - 3, rng)
                spoiled_at = step
            loud.world.until(
                lambda loud=loud, step=step: (
                    loud.done or len(loud.recorder.record.states) > step + 1
                )
            )
        assert loud.bits() == quiet.bits()
        assert all(node.topic_faults.rejected.total() > 0 for node in loud.nodes)


def jump(
    kind: Any, steps: Sequence[int], world: Any, wire: Any, scenario_file: ScenarioFile
) -> Any:
    """A node that was sent the states of some steps, and has handled that of the last."""
    node = world.add(kind, scenario=scenario_file("uu", steps=1000))
    states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)
    s, wires = node.scenario.initial_vehicle_state, wire(node.scenario)
    handled = hear_reactions(world, node)
    strategies = None
    if kind is RobotPlanner:
        strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.RECENT)
    for step in steps:
        world.send(states, wires.state(step, s))
        if strategies is not None:
            nx = node.players.n_states
            zeros = np.zeros((5, 2)), np.zeros((5, 2, nx)), np.zeros((5, nx))
            told = strategy.AffineStrategy(step, 0, *zeros)
            world.send(strategies, strategy.encode(told, node.game.dt))
    world.until(lambda: handled() == steps[-1])
    return node


@pytest.mark.parametrize("kind", [Inference, RobotPlanner, HumanAgent, Recorder])
@pytest.mark.parametrize("stray", [AHEAD + 10, 10**6, 2 * 10**10])
def test_one_stamp_far_in_the_future_deafens_nobody(
    kind: Any, stray: int, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = jump(kind, (0, 1, stray, 2, stray, 3), world, wire, scenario_file)
    assert node.topic_faults.rejected == {"joint_state": 2}
    assert f"step {stray} is not allowed: step 2 was the last" in node.topic_faults.last_rejection


@pytest.mark.parametrize("kind", [Inference, RobotPlanner, HumanAgent, Recorder])
@pytest.mark.parametrize("to", [3, 5000])
def test_a_clock_that_has_jumped_is_followed(
    kind: Any, to: int, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    steps = (400, 401, *range(to, to + CONFIRMED + 2))
    node = jump(kind, steps, world, wire, scenario_file)
    assert node.topic_faults.rejected == {"joint_state": CONFIRMED - 1}


@pytest.mark.parametrize("kind", [Inference, RobotPlanner, HumanAgent, Recorder])
def test_a_first_state_that_comes_again_stops_nobody(
    kind: Any, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = jump(kind, (0, 40, 80, 0, 81), world, wire, scenario_file)
    assert not node.topic_faults.rejected


def hear_reactions(world: Any, node: Any) -> Callable[[], int]:
    """What tells of the step that a node has handled last."""
    if isinstance(node, Recorder):
        return lambda: len(node.record.states) - 1
    reports = world.reports(node)
    return lambda: max((int(r.values.get("step", -1)) for r in reports[-1:]), default=-1)


def test_one_strategy_of_the_future_deafens_no_planner(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(RobotPlanner, scenario=scenario_file("uu"), time="realtime")
    states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.RECENT)
    handled = hear_reactions(world, node)
    zeros = np.zeros((5, 2)), np.zeros((5, 2, 8)), np.zeros((5, 8))
    for step in range(5):
        if step > 1:
            stray = strategy.AffineStrategy(10**6, 0, *zeros)
            world.send(strategies, strategy.encode(stray, node.game.dt))
        good_one = strategy.AffineStrategy(step, 0, *zeros)
        world.send(strategies, strategy.encode(good_one, node.game.dt))
        world.send(states, wire(node.scenario).state(step, node.scenario.initial_vehicle_state))
        world.until(lambda step=step: handled() == step, f"deaf at step {step}")
    assert node.topic_faults.rejected == {"robot_strategy": 3}


def test_a_flood_leaves_no_trace_in_memory(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(Recorder, scenario=scenario_file("uu", steps=1000))
    rng, sizes = np.random.default_rng(0), []
    floods = []
    for topic, message_type, profile in topics(node):
        message = good(topic, message_type, node.scenario, wire)
        publisher = world.publisher(message_type, topic, profile)
        floods.append((publisher, [mutated(message, rng, keep_stamp=True) for _ in range(40)]))
    for _ in range(6):
        for _ in range(10):
            for publisher, spoiled in floods:
                for data in spoiled:
                    publisher.publish(data[: 2**17])
                world.spin()
        sizes.append(memory())
    assert sizes[-1] - sizes[2] < 20e6, [size // 2**20 for size in sizes]
    assert answers(world, node)


def test_a_flood_of_strategies_does_not_come_before_a_state(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(RobotPlanner, scenario=scenario_file("uu"), time="realtime")
    states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.RECENT)
    controls = world.hear(MultiDOFJointTrajectory, "robot/control", qos.LATEST)
    zeros = np.zeros((5, 2)), np.zeros((5, 2, 8)), np.zeros((5, 8))
    world.send(strategies, strategy.encode(strategy.AffineStrategy(0, 0, *zeros), node.game.dt))
    for _ in range(100):
        strategies.publish(Float64MultiArray())
    before = node.topic_faults.rejected.total()
    states.publish(wire(node.scenario).state(0, node.scenario.initial_vehicle_state))
    rejected = []
    on_state = node.publish_control

    def note(*args: Any) -> Any:
        rejected.append(node.topic_faults.rejected.total() - before)
        return on_state(*args)

    node.publish_control = note
    world.until(lambda: controls)
    # All that are in the queue by then, and none of those that come after.
    assert rejected[0] <= qos.RECENT.depth
