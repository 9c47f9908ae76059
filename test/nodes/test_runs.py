"""One run after another with the same nodes: reset, pause, and new seeds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from all_nodes import add_stack
from rclpy.parameter import Parameter
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.simulator import Simulator
from msg_adapters import joint_state, qos

STEPS = 5


class Game:
    """All nodes of a game of two in one process, and what they publish."""

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
        self.states = world.hear(MultiDOFJointState, "joint_state", qos.STREAM, senders=0)
        self.beliefs = world.hear(Float64MultiArray, "belief", qos.STREAM, senders=0)
        common = {"time": time, "use_sim_time": sim_time}
        simulator = {"steps": steps, "publish_clock": sim_time}
        stack = add_stack(
            world, scenario, {"planner": planner}, robot, 4, simulator, listeners=1, **common
        )
        self.recorder, self.inference, self.planner, (self.human,), self.simulator = stack
        self._parameters = {"scenario": scenario, "subscribers": 5, **simulator, **common}

    def restart_simulator(self) -> None:
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
        return self.world.call(kind, service, **request)

    def reset(self, node: GameNode) -> None:
        assert self.call(Trigger, f"{node.get_fully_qualified_name()}/reset").success


Start = Callable[..., Game]


@pytest.fixture
def start(world: Any, scenario_file: ScenarioFile) -> Start:
    def make(time: str = "lockstep", **options: Any) -> Game:
        return Game(world, scenario_file("uu", steps=STEPS, particles=4), time, **options)

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


def test_an_agent_that_is_reset_continues_with_the_next_state(start: Start) -> None:
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


def test_resuming_a_run_that_is_not_paused_changes_nothing(start: Start) -> None:
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


def test_a_node_without_states_says_that_it_waits(world: Any, scenario_file: ScenarioFile) -> None:
    agent = world.add(HumanAgent, scenario=scenario_file("uu"))
    reports = world.reports(agent, first_state=False)
    world.until(lambda: reports)
    assert reports[0].message == "waits for the first joint_state"


def test_a_simulator_says_whom_it_waits_for(world: Any, scenario_file: ScenarioFile) -> None:
    simulator = world.add(Simulator, scenario=scenario_file("uu"), subscribers=3)
    reports = world.reports(simulator)
    world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: any("waits for 2 more subscribers" in r.message for r in reports))
