"""A node goes on whatever it is sent, counts it, and is as before afterwards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bad_messages import cut_off, mutated
from nodes_room import LISTENERS, Run, memory, topics
from rcl_interfaces.srv import GetParameters
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from wire import START

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from msg_adapters import qos, stamp

STEPS = 12


def good(topic: str, message_type: Any, node: Any, wire: Any) -> Any:
    """A message that a node can use, where the topic is known; else an empty one."""
    scenario = node.scenario
    wire = wire(scenario, node.clock if node.clock.start else None)
    name = topic.rpartition("/")[2]
    if name == "run_start":
        return stamp.encode(START)
    if name == "joint_state":
        return wire.state(1, scenario.initial_vehicle_state)
    if name == "control":
        return wire.control(topic.split("/")[-2], 0, [[0.1, 0.2]] * 3)
    if name == "robot_strategy":
        return wire.strategy(1, np.zeros((5, 2)))
    if name == "belief":
        return wire.belief(1)
    return message_type()


def answers(world: Any, node: Any) -> bool:
    name = f"{node.get_fully_qualified_name()}/get_parameters"
    return bool(world.call(GetParameters, name, names=["scenario"]).values[0].string_value)


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
        message = good(topic, message_type, node, wire)
        publisher = world.publisher(message_type, topic, profile)
        # No more than a time takes can be sent where times are sent.
        longest = 12 if topic.endswith("run_start") else None
        for _ in range(25):
            publisher.publish(mutated(message, rng)[:longest])
            world.spin()
        world.send(publisher, message)
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
    quiet = Run(make_world(), file, STEPS, listeners=1)
    quiet.listen()
    quiet.world.until(lambda: quiet.done)
    assert all(len(m) >= STEPS for topic, m in quiet.heard.items() if topic != "/run_start")

    for seed in range(2):
        rng = np.random.default_rng(seed)
        loud, spoiled_at = Run(make_world(), file, STEPS), 0
        while not loud.done:
            step = len(loud.recorder.record.states) - 1
            if step > spoiled_at and step >= 4:
                loud.spoil(quiet, step - 3, rng)
                spoiled_at = step
            loud.world.until(
                lambda loud=loud, step=step: (
                    loud.done or len(loud.recorder.record.states) > step + 1
                )
            )
        assert loud.bits() == quiet.bits()
        assert all(node.topic_faults.rejected.total() > 0 for node in loud.nodes)


def test_a_flood_leaves_no_trace_in_memory(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(Recorder, scenario=scenario_file("uu", steps=1000))
    rng, sizes = np.random.default_rng(0), []
    floods = []
    for topic, message_type, profile in topics(node):
        if topic == "/run_start":
            world.start_run()
            continue
        message = good(topic, message_type, node, wire)
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
    states = world.states()
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.RECENT)
    controls = world.hear(MultiDOFJointTrajectory, "robot/control", qos.LATEST)
    wire = wire(node.scenario)
    world.send(strategies, wire.strategy(0, np.zeros((5, 2))))
    for _ in range(100):
        strategies.publish(Float64MultiArray())
    before = node.topic_faults.rejected.total()
    states.publish(wire.state(0, node.scenario.initial_vehicle_state))
    rejected = []
    on_state = node.publish_control

    def note(*args: Any) -> Any:
        rejected.append(node.topic_faults.rejected.total() - before)
        return on_state(*args)

    node.publish_control = note
    world.until(lambda: controls)
    # All that are in the queue by then, and none of those that come after.
    assert rejected[0] <= qos.RECENT.depth
