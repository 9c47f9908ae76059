"""The closed loop on the core alone, and through real nodes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text
from all_nodes import add_stack
from world import World

from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario

#: Plays a scenario, or one of this content, on the core and by nodes in lockstep.
Compare = Callable[..., RunRecord]


@pytest.fixture
def compare(make_world: Callable[[], World], tmp_path: Path) -> Compare:
    """Plays both, checks that they agree to the bit, and gives the record of the nodes."""

    def play(
        planner: str, seed: int, content: str | dict[str, Any], safety: bool = False
    ) -> RunRecord:
        scenario: str | Path = tmp_path / "scenario.yaml" if isinstance(content, dict) else content
        if isinstance(scenario, Path):
            valid = Scenario.model_validate(content)
            scenario.write_text(yaml_text.dump(valid.model_dump(mode="json")))
        core = closed_loop.run(Scenario.load(scenario), planner, seed, safety)
        seeds, world = RunSeeds.of_run(seed), make_world()
        mind = {"seed": seeds.inference, "planner": planner, "planner_seed": seeds.planner}
        stack = add_stack(world, scenario, mind, {"safety": safety}, seeds.humans)
        recorder, steps = stack.recorder, stack.simulator.steps
        world.until(
            lambda: (
                recorder.record.steps >= steps
                and steps in recorder.record.beliefs
                and steps - 1 in recorder.safety["/robot_planner"]
            ),
            "the run stands still",
        )
        ros = recorder.record
        if safety:
            ros.safety_braked, ros.safety_limited = recorder.safety["/robot_planner"][steps - 1]
        np.testing.assert_array_equal(np.array(ros.states), np.array(core.states))
        np.testing.assert_array_equal(np.array(ros.inputs), np.array(core.inputs))
        if planner == "map":
            assert ros.beliefs == core.beliefs
            assert ros.maps == core.maps
        acted = (ros.safety_braked, ros.safety_limited)
        assert acted == (core.safety_braked, core.safety_limited)
        return ros

    return play


@pytest.mark.parametrize("planner", ["map", "baseline"])
def test_nodes_in_lockstep_do_the_same_as_the_core_to_the_bit(
    planner: str, compare: Compare
) -> None:
    compare(planner, 3, "three_player")


def test_a_safety_layer_does_the_same_in_nodes_and_on_the_core_to_the_bit(compare: Compare) -> None:
    record = compare("baseline", 0, "three_player", safety=True)
    assert record.safety_braked  # without it, this run ends in a collision
    assert record.smallest_distance > 0.5


def test_a_safety_layer_that_does_not_brake_sees_the_same_plan_in_nodes_and_on_the_core(
    compare: Compare,
) -> None:
    # If one of them saw less of the plan, it would brake in one step of this run.
    compare("baseline", 62, "three_player", safety=True)


def test_a_safety_layer_with_tight_limits_too(three_player: Scenario, compare: Compare) -> None:
    content = three_player.model_dump(mode="json")
    content["players"]["robot"]["limits"] = {"omega": [-0.1, 0.1], "a": [-0.3, 0.2]}
    content["inference"]["particles"] = 20
    record = compare("map", 3, content, safety=True)
    assert record.safety_limited
    robot = np.array(record.inputs)[:, :2]
    assert (np.abs(robot) <= [0.1, 0.3]).all() and (robot[:, 1] <= 0.2).all()


def test_nodes_of_a_flat_game_do_the_same_as_the_core_to_the_bit(
    flat_three_player: Scenario, compare: Compare
) -> None:
    record = compare("map", 3, flat_three_player.model_dump())
    ends = record.vehicles.positions(record.states[-1])
    np.testing.assert_allclose(ends, -record.vehicles.positions(record.states[0]), atol=0.5)
    assert record.smallest_distance > 1.0
    # What the robot aligns with costs what the equilibria of the game cost.
    assert (record.costs < 1150).all()


def test_nodes_of_a_game_with_a_car_do_the_same_as_the_core_to_the_bit(
    three_player: Scenario, compare: Compare
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
    record = compare("map", 1, content)
    states = np.array(record.states)
    np.testing.assert_allclose(states[-1, :2], [3.0, 0.0], atol=0.5)
    assert 0.02 < np.abs(states[:, 4]).max() < 0.7
    assert record.smallest_distance > 0.75


def test_a_horizon_of_one_step_is_long_enough_to_weigh() -> None:
    content = Scenario.load("two_player").model_dump() | {"horizon": 1, "steps": 5}
    scenario = Scenario.model_validate(content)
    assert scenario.game.horizon == 1
    record = closed_loop.run(scenario, "map", 0)
    assert record.steps == 5
    assert set(record.beliefs) == set(range(6))


def test_radii_take_the_place_of_longer_distances(three_player: Scenario) -> None:
    """Discs that touch at 0.5 m play, brake and see each other as points that keep 0.5 m more."""
    content = three_player.model_dump() | {"steps": 70}
    points = Scenario.model_validate(content)
    for player in content["players"].values():
        player["radius"] = 0.25
    content["safety"]["clearance"] -= 0.5
    for cost in content["costs"]:
        if cost["kind"] == "proximity":
            cost["radius"] -= 0.5
    discs = Scenario.model_validate(content)
    braked = 0
    for seed in range(4):
        found, expected = (
            closed_loop.run(of, "baseline", seed, safety=True) for of in (discs, points)
        )
        np.testing.assert_array_equal(np.array(found.states), np.array(expected.states))
        np.testing.assert_array_equal(found.costs, expected.costs)
        assert found.safety_braked == expected.safety_braked
        assert found.smallest_distance == expected.smallest_distance - 0.5
        braked += found.safety_braked or 0
    assert braked, "the layer has nothing to do"
