"""The human agents agree without communicating, and do not reveal their seed."""

from __future__ import annotations

from typing import Any

import numpy as np
from rcl_interfaces.msg import Log
from small_scenario import ScenarioFile
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver
from msg_adapters import qos

SEED = 987_654_321


def test_nothing_that_a_human_publishes_contains_its_seed(
    world: Any, wire: Any, scenario_file: ScenarioFile
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
    } == {"/human_1/control", "/diagnostics", "/rosout", "/parameter_events"}
    told = [text for r in reports for pair in r.values.items() for text in (*pair, r.message)]
    told += [line.msg for line in log]
    assert told
    assert not any(str(SEED) in text or "seed" in text for text in told)


def test_humans_with_one_seed_agree_and_with_others_may_not(world: Any, wire: Any) -> None:
    scenario = Scenario.load("two_player")
    players, x = scenario.game.players, scenario.initial_state
    agents = {"a": ("robot", 1), "b": ("human_1", 1), "c": ("human_1", 2)}
    for name, (player, seed) in agents.items():
        world.add(HumanAgent, namespace=name, scenario="two_player", player=player, seed=seed)
    plans = {}
    for name, (player, _) in agents.items():
        heard = world.hear(MultiDOFJointTrajectory, f"/{name}/{player}/control", qos.STREAM)
        states = world.states(f"/{name}/joint_state")
        world.send(states, wire(scenario).state(0, x))
        world.until(lambda heard=heard: heard)
        step, plan = wire(scenario).read_control(player, heard[0])
        assert step == 0
        plans[name] = plan
    core = EquilibriumPlayer(
        GameSolver(scenario.game, scenario.solver), scenario.seeds, np.random.default_rng(1)
    )
    solved = core.solve(0, x)
    joint = [solved.inputs(0, x)[:, 0], *solved.u_ref[1 : len(plans["a"]), :, 0]]
    np.testing.assert_allclose(np.hstack([plans["a"], plans["b"]]), joint, atol=1e-9)
    # One passes before, the other behind: they turn to different sides.
    assert np.sign(plans["b"][0, 0]) != np.sign(plans["c"][0, 0])
    assert len(players) == 2
