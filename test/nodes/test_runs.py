"""One run after another with the same nodes: reset, pause, and seeds drawn anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from msg_adapters import cmd_vel, joint_state, qos, stamp

STEPS = 5


class Stack:
    """All nodes of a game of two in one process, and what they say."""

    def __init__(
        self,
        world: Any,
        scenario: Path,
        time: str = "lockstep",
        sim_time: bool = False,
        steps: int = STEPS,
        planner: str = "map",
        **robot: Any,
    ) -> None:
        self.world = world
        common = {"scenario": scenario, "time": time, "use_sim_time": sim_time}
        self.states = world.hear(MultiDOFJointState, "joint_state", qos.STREAM, senders=0)
        self.beliefs = world.hear(Float64MultiArray, "belief", qos.STREAM, senders=0)
        self.inference = world.add(Inference, seed=3, planner=planner, **common)
        self.planner = world.add(RobotPlanner, **common, **robot)
        self.human = world.add(HumanAgent, seed=4, **common)
        self.recorder = world.add(Recorder, **common)
        # Five subscribers: three nodes, the recorder and the test.
        self._parameters = {"steps": steps, "subscribers": 5, "publish_clock": sim_time, **common}
        self.simulator = world.add(Simulator, **self._parameters)

    def restart_simulator(self) -> None:
        """Have another simulator in the place of the one there is."""
        self.world.remove(self.simulator)
        self.simulator = self.world.add(Simulator, **self._parameters)

    def run(self) -> list[bytes]:
        """Spin until the run is over; what the states and beliefs of it say, bit by bit."""
        self.world.until(lambda: len(self.states) > STEPS and len(self.beliefs) > STEPS)
        # What stands before a belief says when it was.
        heard = [*self.state_bits(), *(b.data[2:].tobytes() for b in self.beliefs)]
        self.forget()
        return heard

    def state_bits(self) -> list[bytes]:
        names = self.simulator.vehicles.joint_names
        decoded = [joint_state.decode(message, names) for message in self.states]
        return [np.concatenate([d.poses, d.twists, d.accelerations]).tobytes() for d in decoded]

    def forget(self) -> None:
        self.states.clear()
        self.beliefs.clear()

    def call(self, kind: Any, service: str, **request: Any) -> Any:
        client = self.world.tester.create_client(kind, service)
        self.world.until(client.service_is_ready, f"nobody serves {service}")
        future = client.call_async(kind.Request(**request))
        self.world.until(future.done, f"{service} does not answer")
        return future.result()

    def reset(self, node: GameNode) -> None:
        assert self.call(Trigger, f"{node.get_fully_qualified_name()}/reset").success


Start = Callable[..., Stack]


@pytest.fixture
def start(world: Any, scenario_file: Callable[..., Path]) -> Start:
    def make(time: str = "lockstep", **options: Any) -> Stack:
        return Stack(world, scenario_file("uu", steps=STEPS, particles=4), time, **options)

    return make


@pytest.mark.parametrize("planner", ["map", "baseline"])
def test_a_run_that_is_reset_is_the_same_to_the_last_bit(planner: str, start: Start) -> None:
    stack = start(planner=planner)
    first = stack.run()
    stack.reset(stack.simulator)
    assert stack.run() == first
    assert stack.recorder.record.steps == STEPS, "the record is that of the last run"


def test_a_simulator_that_is_started_again_begins_a_new_run(start: Start) -> None:
    stack = start()
    first = stack.run()
    stack.restart_simulator()
    assert stack.run() == first


def test_a_run_can_be_reset_in_the_midst_of_it(start: Start) -> None:
    stack = start()
    first = stack.run()
    stack.reset(stack.simulator)
    stack.world.until(lambda: len(stack.states) > 2)
    stack.reset(stack.simulator)
    stack.world.until(lambda: stack.simulator.done)
    stack.world.until(lambda: len(stack.recorder.record.beliefs) == STEPS + 1)
    stack.world.spin(0.1)
    assert stack.state_bits()[-STEPS - 1 :] == first[: STEPS + 1]


@pytest.mark.parametrize("who", ["human", "inference"])
def test_reset_agents_draw_other_seeds_and_a_change_of_the_seed_brings_the_first_back(
    who: str, start: Start
) -> None:
    stack = start()
    first = stack.run()
    agent = getattr(stack, who)
    stack.reset(agent)
    stack.reset(stack.simulator)
    second = stack.run()
    assert second != first
    stack.reset(stack.simulator)
    assert stack.run() == second, "without a reset of its own, an agent sticks to what it has"
    seed = agent.get_parameter("seed").value
    (result,) = agent.set_parameters([Parameter("seed", value=seed)])
    assert result.successful
    stack.reset(stack.simulator)
    assert stack.run() == first


def test_an_agent_that_is_reset_goes_on_with_the_next_state(start: Start) -> None:
    stack = start()
    stack.call(SetBool, "/simulator/pause", data=True)
    stack.world.until(lambda: stack.beliefs)
    stack.reset(stack.inference)
    stack.reset(stack.human)
    stack.call(SetBool, "/simulator/pause", data=False)
    stack.world.until(lambda: stack.simulator.done)
    stack.world.until(lambda: len(stack.beliefs) == STEPS + 1)


@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_a_pause_stops_time_and_changes_nothing_else(time: str, start: Start) -> None:
    # In realtime it takes time to find the service.
    stack = start(time, steps=STEPS if time == "lockstep" else 100)
    stack.world.until(lambda: len(stack.states) > 1)
    answer = stack.call(SetBool, "/simulator/pause", data=True)
    assert answer.success and "paused at step" in answer.message
    stack.world.spin(0.3)
    before = len(stack.states)
    assert not stack.simulator.done
    stack.world.spin(0.5)
    assert len(stack.states) == before
    answer = stack.call(SetBool, "/simulator/pause", data=False)
    assert answer.success and f"resumed at step {before - 1}" in answer.message
    if time == "lockstep":
        heard = stack.run()
        stack.reset(stack.simulator)
        assert stack.run() == heard
    else:
        stack.world.until(lambda: len(stack.states) > before + 2)


def test_to_let_a_run_go_on_that_goes_on_changes_nothing(start: Start) -> None:
    stack = start("realtime", steps=1000)
    stack.world.until(lambda: len(stack.states) > 1)
    client = stack.world.tester.create_client(SetBool, "/simulator/pause")
    stack.world.until(client.service_is_ready)
    before, asked = len(stack.states), 0
    while len(stack.states) < before + 5:  # more often than steps come
        future = client.call_async(SetBool.Request(data=False))
        stack.world.until(future.done)
        asked += 1
        assert asked < 5000, "time stands still"


def test_a_paused_simulator_says_so(start: Start) -> None:
    stack = start("realtime", steps=1000)
    reports = stack.world.reports(stack.simulator)
    stack.call(SetBool, "/simulator/pause", data=True)
    stack.world.until(lambda: any(r.message.startswith("paused at step") for r in reports))
    assert reports[-1].values["idle"]


@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_a_run_makes_the_simulated_time_that_its_nodes_go_by(time: str, start: Start) -> None:
    stack = start(time, sim_time=True)
    stack.world.until(lambda: stack.simulator.done)
    end = stack.simulator.clock.stamp(STEPS)
    for node in (stack.inference, stack.planner, stack.human):
        stack.world.until(lambda node=node: node.get_clock().now().nanoseconds == end)


def test_a_planner_can_be_changed_while_it_runs(start: Start) -> None:
    stack = start()
    aligned = stack.run()
    (result,) = stack.inference.set_parameters([Parameter("planner", value="baseline")])
    assert result.successful
    stack.reset(stack.simulator)
    stubborn = stack.run()
    assert stubborn != aligned
    stack.inference.set_parameters([Parameter("planner", value="map")])
    stack.reset(stack.simulator)
    assert stack.run() == aligned


def test_live_parameters_count(start: Start) -> None:
    stack = start()
    stack.run()
    stack.inference.set_parameters([Parameter("particles", value=7)])
    stack.reset(stack.simulator)
    stack.world.until(lambda: stack.beliefs)
    assert stack.beliefs[0].layout.dim[0].size == 7


def test_a_base_is_stopped_while_states_are_missing(start: Start) -> None:
    stack = start("realtime", brake_after=0.3, steps=1000)
    heard: list[TwistStamped] = stack.world.hear(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    reports = stack.world.reports(stack.planner)
    stack.world.until(lambda: len(stack.states) > 1 and heard)
    assert np.abs(cmd_vel.decode(heard[0], "robot")).max() > 0.0
    stack.call(SetBool, "/simulator/pause", data=True)
    stack.world.until(lambda: any("brakes: no joint_state for" in r.message for r in reports))
    stack.world.until(lambda: not cmd_vel.decode(heard[-1], "robot").any())
    before, told = len(heard), len(reports)
    stack.world.until(lambda: len(heard) > before + 2, "it is told to stand only once")
    stack.call(SetBool, "/simulator/pause", data=False)
    stack.world.until(lambda: any("follows its strategy" in r.message for r in reports[told:]))
    now = stack.planner.get_clock().now().nanoseconds * 1e-9
    assert abs(1e-9 * stamp.decode(heard[-1].header.stamp) - now) < 60.0, (
        "bases compare to their clock"
    )


def test_a_node_without_states_says_that_it_waits(
    world: Any, scenario_file: Callable[..., Path]
) -> None:
    agent = world.add(HumanAgent, scenario=scenario_file("uu"))
    reports = world.reports(agent, first_state=False)
    world.until(lambda: reports)
    assert reports[0].message == "waits for the first joint_state"


def test_a_simulator_says_whom_it_waits_for(world: Any, scenario_file: Callable[..., Path]) -> None:
    simulator = world.add(Simulator, scenario=scenario_file("uu"), subscribers=3)
    reports = world.reports(simulator)
    world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: any("waits for 2 more subscribers" in r.message for r in reports))
