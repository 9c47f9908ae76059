"""The closed loop on the core alone, and through real nodes."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml_text
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ros_domain import free_domain

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario


@pytest.fixture
def write(tmp_path: Path) -> Callable[[Scenario], str]:
    """Writes a scenario to a file, for nodes to read."""

    def to_file(scenario: Scenario) -> str:
        path = tmp_path / "scenario.yaml"
        path.write_text(yaml_text.dump(scenario.model_dump(mode="json")))
        return str(path)

    return to_file


def run_nodes(planner: str, seed: int, name_or_file: str, safety: bool) -> RunRecord:
    """What `closed_loop.run` does, by nodes that talk over DDS."""
    scenario = Scenario.load(name_or_file)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=free_domain())
    seeds = RunSeeds.of_run(seed)

    def options(**parameters: object) -> dict[str, object]:
        parameters["scenario"] = name_or_file
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        return {"context": context, "parameter_overrides": overrides}

    recorder = Recorder(**options())
    names = scenario.game.players.names
    nodes = [
        recorder,
        Inference(**options(seed=seeds.inference, planner=planner, planner_seed=seeds.planner)),
        RobotPlanner(**options(safety=safety)),
        *(
            HumanAgent(f"{name}_agent", **options(player=name, seed=seeds.humans))
            for name in names[1:]
        ),
        Simulator(**options(subscribers=len(names) + 2)),
    ]
    executor = SingleThreadedExecutor(context=context)
    for node in nodes:
        executor.add_node(node)
    deadline = time.monotonic() + 120
    steps = scenario.steps
    while (
        recorder.record.steps < steps
        or steps not in recorder.record.beliefs
        or steps - 1 not in recorder.safety["/robot_planner"]
    ):
        assert time.monotonic() < deadline, f"standstill at step {recorder.record.steps}"
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()
    record = recorder.record
    if safety:
        record.safety_braked, record.safety_limited = recorder.safety["/robot_planner"][steps - 1]
    return record


def assert_the_same_to_the_bit(
    planner: str, seed: int, name_or_file: str, safety: bool = False
) -> RunRecord:
    """Play on the core and by nodes in lockstep; returns the record of the nodes."""
    core = closed_loop.run(Scenario.load(name_or_file), planner, seed, safety)
    ros = run_nodes(planner, seed, name_or_file, safety)
    np.testing.assert_array_equal(np.array(ros.states), np.array(core.states))
    np.testing.assert_array_equal(np.array(ros.inputs), np.array(core.inputs))
    if planner == "map":
        assert ros.beliefs == core.beliefs
        assert ros.maps == core.maps
    acted = (ros.safety_braked, ros.safety_limited)
    assert acted == (core.safety_braked, core.safety_limited)
    return ros


@pytest.mark.parametrize("planner", ["map", "baseline"])
def test_nodes_in_lockstep_do_the_same_as_the_core_to_the_bit(planner: str) -> None:
    assert_the_same_to_the_bit(planner, 3, "three_player")


def test_a_safety_layer_does_the_same_in_nodes_and_on_the_core_to_the_bit() -> None:
    record = assert_the_same_to_the_bit("baseline", 0, "three_player", safety=True)
    assert record.safety_braked  # without it, this run ends in a collision
    assert record.smallest_distance > 0.5


def test_a_safety_layer_that_does_not_brake_sees_the_same_plan_in_nodes_and_on_the_core() -> None:
    # If one of them saw less of the plan, it would brake in one step of this run.
    assert_the_same_to_the_bit("baseline", 62, "three_player", safety=True)


def test_a_safety_layer_with_tight_limits_too(
    three_player: Scenario, write: Callable[[Scenario], str]
) -> None:
    content = three_player.model_dump(mode="json")
    content["players"]["robot"]["limits"] = {"omega": [-0.1, 0.1], "a": [-0.3, 0.2]}
    content["inference"]["particles"] = 20
    tight = write(Scenario.model_validate(content))
    record = assert_the_same_to_the_bit("map", 3, tight, safety=True)
    assert record.safety_limited
    robot = np.array(record.inputs)[:, :2]
    assert (np.abs(robot) <= [0.1, 0.3]).all() and (robot[:, 1] <= 0.2).all()


def test_nodes_of_a_flat_game_do_the_same_as_the_core_to_the_bit(
    flat_three_player: Scenario, write: Callable[[Scenario], str]
) -> None:
    record = assert_the_same_to_the_bit("map", 3, write(flat_three_player))
    ends = record.vehicles.positions(record.states[-1])
    np.testing.assert_allclose(ends, -record.vehicles.positions(record.states[0]), atol=0.5)
    assert record.smallest_distance > 1.0
    # What the robot aligns with costs what the equilibria of the game cost.
    assert (record.costs < 1150).all()


def test_nodes_of_a_game_with_a_car_do_the_same_as_the_core_to_the_bit(
    three_player: Scenario, write: Callable[[Scenario], str]
) -> None:
    content = three_player.model_dump()
    robot, others = content["players"]["robot"], ("human_1", "human_2")
    robot["dynamics"] = {"kind": "car", "wheelbase": 0.5}
    robot["initial"], robot["limits"] = (*robot["initial"], 0.0), {}
    effort, speed, turning, acceleration, top_speed, distance, goal = content["costs"]
    goals = goal["goals"]
    content["costs"] = [
        *(effort, acceleration, top_speed, distance),
        {**turning, "players": others},
        {**speed, "players": others},
        {**goal, "players": others, "goals": {name: goals[name] for name in others}},
        {**turning, "of": "steering", "low": -0.6, "high": 0.6, "players": ("robot",)},
        {**speed, "weights": (*speed["weights"], 1.0), "players": ("robot",)},
        {
            **goal,
            "weights": (*goal["weights"], 0.0),
            "goals": {"robot": (*goals["robot"], 0.0)},
            "players": ("robot",),
        },
    ]
    content["inference"]["particles"] = 20
    record = assert_the_same_to_the_bit("map", 1, write(Scenario.model_validate(content)))
    states = np.array(record.states)
    np.testing.assert_allclose(states[-1, :2], [3.0, 0.0], atol=0.5)
    assert 0.02 < np.abs(states[:, 4]).max() < 0.7
    assert record.smallest_distance > 0.75


def test_alignment_pays_for_everybody() -> None:
    scenario = Scenario.load("three_player")
    costs = {
        planner: np.array([closed_loop.run(scenario, planner, seed).costs for seed in range(8)])
        for planner in ("map", "baseline")
    }
    # The mean over many seeds is about 690; the dearest of the equilibria costs almost 800.
    assert (costs["map"].mean(axis=0) < 740).all()
    assert (costs["map"] < 820).all()
    # On some seeds, the baseline happens to play the equilibrium of the humans.
    assert (costs["map"].mean(axis=0) < 0.9 * costs["baseline"].mean(axis=0)).all()


def test_unknown_planner_is_refused() -> None:
    with pytest.raises(ValueError, match="planner: 'other' is not allowed"):
        closed_loop.run(Scenario.load("three_player"), "other", 0)


def test_a_horizon_of_one_step_is_long_enough_to_weigh() -> None:
    content = Scenario.load("two_player").model_dump() | {"horizon": 1, "steps": 5}
    scenario = Scenario.model_validate(content)
    assert scenario.game.horizon == 1
    record = closed_loop.run(scenario, "map", 0)
    assert record.steps == 5
    assert set(record.beliefs) == set(range(6))


@pytest.mark.parametrize("cap", [None, 1])
def test_threads_make_no_difference_to_a_run_of_five(
    cap: int | None, five_player: Scenario
) -> None:
    records = []
    for threads in (1, 2):
        # A copy of the model would keep its game, with the long horizon.
        content = five_player.model_dump() | {"horizon": 40, "steps": 4}
        content["costs"][-1]["active_from"] = 3.85
        content["inference"] |= {"particles": 20, "max_iterations": cap}
        content["solver"] |= {"threads": threads}
        short = Scenario.model_validate(content)
        assert (short.game.horizon, short.solver.threads) == (40, threads)
        records.append(closed_loop.run(short, "map", 0))
    one, other = records
    np.testing.assert_array_equal(np.array(one.states), np.array(other.states))
    np.testing.assert_array_equal(np.array(one.inputs), np.array(other.inputs))
    assert one.beliefs == other.beliefs
    assert one.maps == other.maps
    assert one.steps == 4 and np.isfinite(np.array(one.states)).all()
    assert len(one.beliefs[0]) == 20 and len(one.beliefs[4]) > 1
    assert np.abs(one.states[-1] - one.states[0]).max() > 0.1
