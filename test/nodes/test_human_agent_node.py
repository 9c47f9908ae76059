"""The human agents: they agree without a word, and keep their secret."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rcl_interfaces.msg import Log
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ
from msg_adapters import qos

SEED = 987_654_321


@pytest.mark.parametrize("player", ["robot", "human_1", "human_2"])
def test_each_plays_its_part_of_the_equilibrium_of_the_seed(
    player: str, world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> None:
    file = scenario_file("uud")
    scenario = Scenario.load(file)
    wire = wire(scenario)
    agent = world.add(HumanAgent, scenario=file, player=player, seed=SEED, plan_length=3)
    reports = world.reports(agent)
    states = world.states()
    heard = world.hear(MultiDOFJointTrajectory, f"{player}/control", qos.STREAM)
    core = EquilibriumPlayer(
        IterativeLQ(scenario.game, scenario.solver), scenario.seeds, np.random.default_rng(SEED)
    )
    own = scenario.game.players.inputs(scenario.game.players.index(player))
    x = scenario.initial_state
    for step in range(3):
        world.send(states, wire.state(step, x))
        world.until(lambda step=step: len(heard) > step and len(reports) > step)
        found, inputs = wire.read_control(player, heard[step])
        strategy = core.solve(step, x)
        assert found == step
        assert len(inputs) == 3
        expected = strategy.inputs(step, x)[:, 0]
        np.testing.assert_allclose(inputs[0], expected[own], rtol=0, atol=1e-9)
        np.testing.assert_allclose(inputs[1:], strategy.u_ref[1:3, own, 0], rtol=0, atol=1e-9)
        assert reports[step].values["step"] == str(step)
        x = scenario.game.step(x, expected) + 0.01


def test_what_a_human_tells_does_not_hold_its_seed(
    world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> None:
    file = scenario_file("uu")
    scenario = Scenario.load(file)
    log = world.hear(Log, "/rosout", qos.STREAM, senders=0)
    agent = world.add(HumanAgent, scenario=file, player="human_1", seed=SEED)
    reports = world.reports(agent)
    states = world.states()
    for step in range(2):
        world.send(states, wire(scenario).state(step, scenario.initial_state))
        world.until(lambda step=step: len(reports) > step)
    assert {
        name for name, _ in agent.get_publisher_names_and_types_by_node("human_agent", "/")
    } == {
        "/human_1/control",
        "/diagnostics",
        "/rosout",
        "/parameter_events",
    }
    told = [text for r in reports for pair in r.values.items() for text in (*pair, r.message)]
    told += [line.msg for line in log]
    assert told
    assert not any(str(SEED) in text or "seed" in text for text in told)


def test_the_robot_hears_nothing_but_states_and_strategies(
    world: Any, scenario_file: Callable[..., Path]
) -> None:
    file = scenario_file("uu")
    for make, heard in (
        (Inference, {"/run_start", "/joint_state"}),
        (RobotPlanner, {"/run_start", "/joint_state", "/robot_strategy"}),
    ):
        node = world.add(make, scenario=file)
        name = node.get_name()
        topics = {topic for topic, _ in node.get_subscriber_names_and_types_by_node(name, "/")}
        # No service, so no parameter of a human; no /parameter_events, which tells them at start.
        assert topics == heard
        assert node.get_client_names_and_types_by_node(name, "/") == []


def test_humans_with_one_seed_agree_and_others_need_not(world: Any, wire: Any) -> None:
    scenario = Scenario.load("two_player")
    players, x = scenario.game.players, scenario.initial_state
    agents = {"a": ("robot", 1), "b": ("human_1", 1), "c": ("human_1", 2)}
    for name, (player, seed) in agents.items():
        world.add(HumanAgent, namespace=name, scenario="two_player", player=player, seed=seed)
    inputs = {}
    for name, (player, _) in agents.items():
        heard = world.hear(MultiDOFJointTrajectory, f"/{name}/{player}/control", qos.STREAM)
        states = world.states(f"/{name}/joint_state")
        world.send(states, wire(scenario).state(0, x))
        world.until(lambda heard=heard: heard)
        inputs[name] = wire(scenario).read_control(player, heard[0])[1][0]
    core = EquilibriumPlayer(
        IterativeLQ(scenario.game, scenario.solver), scenario.seeds, np.random.default_rng(1)
    )
    joint = core.solve(0, x).inputs(0, x)[:, 0]
    np.testing.assert_allclose(np.concatenate([inputs["a"], inputs["b"]]), joint, atol=1e-9)
    # One passes before, the other behind: they turn to different sides.
    assert np.sign(inputs["b"][0]) != np.sign(inputs["c"][0])
    assert len(players) == 2
