"""The closed loop on the core alone, and through real nodes."""

from __future__ import annotations

import time

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ros_domain import free_domain

from gameinfer_ros.experiments import closed_loop
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.run_record import RunRecord
from gameinfer_ros.run_seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from msg_adapters import joint_state


def run_nodes(planner: str, seed: int, scenario: Scenario) -> RunRecord:
    """What `closed_loop.run` does, by nodes that talk over DDS."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=free_domain())
    seeds = RunSeeds.of_run(seed)

    def options(**parameters: object) -> dict[str, object]:
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        return {"context": context, "parameter_overrides": overrides}

    recorder = Recorder(**options())
    nodes = [
        recorder,
        Inference(**options(seed=seeds.inference)),
        RobotPlanner(**options(planner=planner, seed=seeds.baseline)),
        *(
            HumanAgent(f"{name}_agent", **options(player=name, seed=seeds.humans))
            for name in scenario.game.players.names[1:]
        ),
        Simulator(**options(subscribers=5)),
    ]
    executor = SingleThreadedExecutor(context=context)
    for node in nodes:
        executor.add_node(node)
    deadline = time.monotonic() + 120
    while recorder.record.steps < scenario.steps or scenario.steps not in recorder.record.beliefs:
        assert time.monotonic() < deadline, f"standstill at step {recorder.record.steps}"
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()
    return recorder.record


@pytest.mark.parametrize("planner", ["map", "baseline"])
def test_nodes_in_lockstep_do_the_same_as_the_core_to_the_bit(planner: str) -> None:
    scenario = Scenario.load("three_player")
    players = scenario.game.players
    last = scenario.initial_state

    def observe(x: np.ndarray) -> np.ndarray:
        # Over the wire, a heading goes as a quaternion, which costs its last bits.
        nonlocal last
        u = np.zeros(players.n_inputs)
        sent = joint_state.JointState(
            0, players.poses(x), players.twists(x, u), players.accelerations(u)
        )
        message = joint_state.encode(sent, players.names, scenario.dt)
        received = joint_state.decode(message, players.names, scenario.dt)
        last = players.unwrap(players.state(received.poses, received.twists), last)
        return last

    core = closed_loop.run(scenario, planner, 3, observe)
    ros = run_nodes(planner, 3, scenario)
    seen = np.array([observe(x) for x in core.states])
    np.testing.assert_array_equal(np.array(ros.states), seen)
    np.testing.assert_array_equal(np.array(ros.inputs), np.array(core.inputs))
    if planner == "map":
        assert ros.beliefs == core.beliefs
        assert ros.maps == core.maps


def test_alignment_pays_for_everybody() -> None:
    scenario = Scenario.load("three_player")
    costs = {
        planner: np.array([closed_loop.run(scenario, planner, seed).costs for seed in range(8)])
        for planner in ("map", "baseline")
    }
    assert (costs["map"] < 760).all()
    # On some seeds, the baseline happens to play the equilibrium of the humans.
    assert (costs["map"].mean(axis=0) < 0.9 * costs["baseline"].mean(axis=0)).all()


def test_unknown_planner_is_refused() -> None:
    with pytest.raises(ValueError, match="planner: 'other' is not allowed"):
        closed_loop.run(Scenario.load("three_player"), "other", 0)


def test_a_horizon_of_one_step_is_long_enough_to_weigh() -> None:
    scenario = Scenario.load("two_player").model_copy(update={"horizon": 1, "steps": 5})
    record = closed_loop.run(scenario, "map", 0)
    assert record.steps == 5
    assert set(record.beliefs) == set(range(6))
