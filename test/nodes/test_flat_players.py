"""What the nodes make of unicycles of whom the game sees flat coordinates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray
from wire import START

from gameinfer_ros.inference import Belief
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ
from msg_adapters import belief, cmd_vel, equilibrium, markers, qos, strategy

HEADING = 2.0
SEED = 11


@pytest.fixture
def file(scenario_file: Callable[..., Path]) -> Path:
    """A flat robot and a flat human who stand still, across to where they want to go."""
    return scenario_file("ff", heading=HEADING)


@pytest.fixture
def scenario(file: Path) -> Scenario:
    return Scenario.load(file)


def some_states(scenario: Scenario, count: int = 4) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """States and inputs of vehicles that stand still at first and then turn and accelerate."""
    rng, vehicles = np.random.default_rng(7), scenario.vehicles
    s, w = [scenario.initial_vehicle_state], [np.zeros(vehicles.n_inputs)]
    for _ in range(count - 1):
        w.append(rng.uniform(-0.5, 0.5, len(w[0])))
        s.append(vehicles.step(s[-1], w[-1]))
    return s, w


def test_the_simulator_moves_unicycles(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    simulator = world.add(Simulator, scenario=file)
    wire = wire(scenario, simulator.clock)
    hands = {
        name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        for name in ("robot", "human_1")
    }
    heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: heard)
    s = wire.read_state(heard[0])
    np.testing.assert_allclose(s, [0.0, 0.0, HEADING, 0.0, 0.0, 1.0, HEADING, 0.0], atol=1e-12)
    w = np.array([0.3, 1.0, -0.2, 2.0])
    world.send(hands["robot"], wire.control("robot", 0, w[:2]))
    world.send(hands["human_1"], wire.control("human_1", 0, w[2:]))
    world.until(lambda: len(heard) > 1)
    expected = scenario.vehicles.step(scenario.initial_vehicle_state, w)
    np.testing.assert_allclose(wire.read_state(heard[1]), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("player", ["robot", "human_1"])
def test_a_plan_is_told_as_inputs_of_the_vehicle_one_after_the_other(
    player: str, file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    wire, vehicles, game = wire(scenario), scenario.vehicles, scenario.game
    agent = world.add(HumanAgent, scenario=file, player=player, seed=SEED, plan_length=4)
    reports = world.reports(agent)
    states = world.states()
    heard = world.hear(MultiDOFJointTrajectory, f"{player}/control", qos.STREAM)
    core = EquilibriumPlayer(
        IterativeLQ(game, scenario.solver), scenario.seeds, np.random.default_rng(SEED)
    )
    own = game.players.inputs(game.players.index(player))
    rows = vehicles.states(vehicles.index(player))
    for step, s in enumerate(some_states(scenario)[0]):
        world.send(states, wire.state(step, s))
        world.until(lambda step=step: len(heard) > step and len(reports) > step)
        found, inputs = wire.read_control(player, heard[step])
        assert found == step
        assert len(inputs) == 4
        x = vehicles.game_state(s)
        planned = core.solve(step, x)
        plan = [planned.inputs(step, x)[own, 0], *planned.u_ref[1:4, own, 0]]
        # What the vehicle does by its inputs is what the game would have it do.
        for w_own, u_own in zip(inputs, plan, strict=True):
            u, w = np.zeros(4), np.zeros(4)
            u[own], w[own] = u_own, w_own
            expected = game.step(vehicles.game_state(s), u)[rows][[1, 3]]
            s = vehicles.step(s, w)
            after = vehicles.game_state(s)[rows][[1, 3]]
            np.testing.assert_allclose(after, expected, rtol=0, atol=1e-9)


def test_the_velocity_for_a_base_is_that_of_the_unicycle_at_the_end_of_the_step(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    world.add(RobotPlanner, scenario=file)
    states = world.states()
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.LATEST)
    heard = world.hear(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    s = scenario.initial_vehicle_state
    u = 2.0 * np.array([np.cos(HEADING + 0.5), np.sin(HEADING + 0.5)])
    told = strategy.AffineStrategy(START, 0, u[None], np.zeros((1, 2, 8)), np.zeros((1, 8)))
    world.send(strategies, strategy.encode(told))
    world.send(states, wire(scenario).state(0, s))
    world.until(lambda: heard)
    velocity = cmd_vel.decode(heard[0], "robot")
    # From a standstill it turns by 0.5 rad within the step, and is 2 m/s^2 * 0.1 s fast then.
    np.testing.assert_allclose(velocity, [0.2, 0.0, 5.0], rtol=0, atol=1e-9)


def test_the_belief_weighs_what_the_game_sees(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    wire, vehicles, own = wire(scenario), scenario.vehicles, slice(0, 2)
    world.add(Inference, scenario=file, seed=3)
    states = world.states()
    heard = world.hear(Float64MultiArray, "belief", qos.STREAM)
    core = Belief(
        IterativeLQ(scenario.game, scenario.solver),
        scenario.seeds,
        scenario.inference,
        np.random.default_rng(3),
    )
    s, w = some_states(scenario)
    for step in range(len(s)):
        world.send(states, wire.state(step, s[step], w[step]))
        world.until(lambda step=step: len(heard) > step)
        x = vehicles.game_state(s[step])
        if step:
            last = s[step - 1]
            u_robot = vehicles.game_input(last, w[step])[own]
            core.weigh(step - 1, vehicles.game_state(last), x, u_robot)
            core.combine_duplicates()
        else:
            core.solve(step, x)
        found = belief.decode(heard[step], 2)
        np.testing.assert_array_equal(found.ids, core.ids)
        np.testing.assert_allclose(found.weights, core.weights, rtol=1e-6)
        if step:
            core.solve(step, x)


def test_viewers_are_shown_unicycles(file: Path, scenario: Scenario, world: Any, wire: Any) -> None:
    world.add(Inference, scenario=file, seed=3)
    states = world.states()
    paths = world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    drawn = world.hear(MarkerArray, "markers", qos.STREAM)
    told = world.hear(Float64MultiArray, "robot_strategy", qos.STREAM)
    vehicles, s = scenario.vehicles, scenario.initial_vehicle_state
    world.send(states, wire(scenario).state(0, s))
    world.until(lambda: paths and drawn and told)
    arrows = [shape for shape in markers.decode(drawn[0]) if isinstance(shape, markers.Arrow)]
    poses = [arrow.pose for arrow in arrows]
    np.testing.assert_allclose(poses, [[0, 0, HEADING], [0, 1, HEADING]], atol=1e-9)

    found = equilibrium.decode(paths[0], vehicles.names)
    x = strategy.decode(told[0], 2, 8).x_ref
    for k in range(len(x)):
        shown = vehicles.game_state(vehicles.state(found.poses[k], found.twists[k]))
        np.testing.assert_allclose(shown, x[k], rtol=0, atol=1e-9)
    # At the start, where they stand still, they are shown with the heading that they have.
    np.testing.assert_allclose(found.poses[0, :, 2], HEADING, atol=1e-9)
    # The rates are those at which the next pose is reached.
    turns = np.diff(np.unwrap(found.poses[..., 2], axis=0), axis=0)
    rates = scenario.dt * found.twists[:-1, :, 2]
    np.testing.assert_allclose(turns, rates, rtol=0, atol=1e-9)


def test_the_record_is_of_vehicles_and_its_costs_are_those_of_the_game(
    file: Path, scenario: Scenario, world: Any, wire: Any
) -> None:
    recorder = world.add(Recorder, scenario=file)
    states = world.states()
    s, w = some_states(scenario)
    for step in range(len(s)):
        world.send(states, wire(scenario).state(step, s[step], w[step]))
    world.until(lambda: len(recorder.record.states) == len(s))
    record = recorder.record
    np.testing.assert_allclose(record.states, s, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(record.inputs, w[1:])
    vehicles = scenario.vehicles
    x = np.array([vehicles.game_state(state) for state in s[:-1]])
    u = np.array([vehicles.game_input(*pair) for pair in zip(s[:-1], w[1:], strict=True)])
    expected = scenario.game.costs(x, u).sum(axis=1)
    np.testing.assert_allclose(record.costs, expected, rtol=1e-9)
