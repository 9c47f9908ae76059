"""The inference node: what it weighs, and what it tells."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import yaml_text
from geometry_msgs.msg import TwistStamped
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray
from watcher import Watcher, WatcherFactory, walk

from gameinfer_ros.inference import Belief
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.viewing.scene import Scene
from gameinfer_ros.solver import GameSolver
from msg_adapters import cmd_vel, diagnostics, equilibrium, markers, qos


@pytest.mark.parametrize("robot_plays", [True, False])
def test_it_publishes_the_belief_of_the_core(
    robot_plays: bool, make_watcher: WatcherFactory
) -> None:
    watcher = make_watcher(robot_plays=robot_plays, particles=6, duplicate_tolerance=0.01)
    x, u = walk(watcher)
    scenario, own = watcher.scenario, slice(0, 2)
    core = Belief(
        GameSolver(watcher.game, scenario.solver),
        scenario.seeds,
        scenario.inference.model_copy(update={"particles": 6}),
        np.random.default_rng(3),
        robot_plays,
    )
    for step, (state, inputs) in enumerate(zip(x, u, strict=True)):
        watcher.see(step, state, inputs)
        if not step:
            core.solve(step, state)
        else:
            core.weigh(step - 1, x[step - 1], state, inputs[own])
            core.combine_duplicates()
        found, told = watcher.beliefs[step], watcher.strategies[step]
        assert watcher.steps([found, told]) == [step, step]
        np.testing.assert_array_equal(found.ids, core.ids)
        np.testing.assert_allclose(found.weights, core.weights, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found.costs, core.costs.T, rtol=1e-6)
        np.testing.assert_array_equal(found.settled, core.settled)
        assert found.weights.sum() == pytest.approx(1.0, abs=1e-9)
        assert told.particle == found.map == core.ids[core.map_index]
        # The horizon starts at the state, though it was solved from the one before.
        reaction = told.u_ref[0] - told.P[0] @ (state - told.x_ref[0])
        expected = core.strategy.inputs(step, state)[own, core.map_index]
        np.testing.assert_allclose(reaction, expected, rtol=1e-6, atol=1e-9)
        if step:
            core.solve(step, state)
    assert any(1 < len(found.ids) < 6 for found in watcher.beliefs)  # some were duplicates


@pytest.mark.parametrize("robot_plays", [True, False])
def test_the_state_of_the_robot_is_weighed_only_if_it_does_not_play(
    robot_plays: bool, make_watcher: WatcherFactory
) -> None:
    weights = []
    for shift in (0.0, 0.1):
        one = make_watcher(robot_plays=robot_plays)
        x, u = walk(one, 1)
        one.see(0, x[0])
        one.see(1, x[1] + np.array([0.0, shift, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), u[1])
        weights.append(one.beliefs[1].weights)
    same = np.allclose(weights[0], weights[1], rtol=1e-9, atol=0)
    assert same == robot_plays


@pytest.mark.parametrize(("particles", "expected"), [(0, 4), (1, 1), (7, 7)])
def test_there_are_as_many_particles_as_asked_for(
    particles: int, expected: int, make_watcher: WatcherFactory
) -> None:
    watcher = make_watcher(particles=particles)
    watcher.see(0, watcher.scenario.initial_state)
    (first,) = watcher.beliefs
    assert len(first.weights) == expected
    np.testing.assert_allclose(first.weights, 1 / expected)
    assert watcher.reports[0].values["particles"] == str(expected)


def test_the_report_agrees_with_the_belief(make_watcher: WatcherFactory) -> None:
    watcher = make_watcher(particles=6)
    for step, (x, u) in enumerate(zip(*walk(watcher), strict=True)):
        watcher.see(step, x, u)
        told, summary = watcher.reports[step].values, watcher.beliefs[step]
        assert told["step"] == str(step)
        assert told["map"] == str(watcher.strategies[step].particle) == str(summary.map)
        likeliest = summary.weights[summary.ids.tolist().index(int(told["map"]))]
        assert float(told["map_probability"]) == pytest.approx(likeliest, abs=1e-6)
        size = float(told["effective_sample_size"])
        assert size == pytest.approx(1 / np.sum(summary.weights**2), abs=0.01)
        assert float(told["solve_ms"]) > 0
        assert told["missed_deadlines"] == "0"
        assert told["rejected_messages"] == "0"
        assert told["particles"] == told["updated_particles"] == "6"
        # The belief is told before its particles are solved from the state, the report after it.
        before = watcher.reports[max(0, step - 1)].values["settled_particles"]
        assert summary.settled.sum() == int(before)


@pytest.mark.parametrize("kinds", ["ud", "ff", "cu"])
def test_the_map_equilibrium_is_the_trajectory_of_all_vehicles(
    kinds: str, make_watcher: WatcherFactory
) -> None:
    watcher = make_watcher(kinds)
    heard = watcher.world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    drawn = watcher.world.hear(MarkerArray, "markers", qos.STREAM)
    vehicles = watcher.scenario.vehicles
    for step, (s, w) in enumerate(zip(*walk(watcher, 2), strict=True)):
        watcher.see(step, s, w)
        watcher.world.until(lambda step=step: len(heard) > step and len(drawn) > step)
        found = equilibrium.decode(heard[step], vehicles.joint_names)
        assert watcher.wire.clock.step(found.stamp) == step
        references = watcher.strategies[step].x_ref
        for k, x_ref in enumerate(references):
            x = vehicles.game_state(vehicles.state(found.poses[k], found.twists[k]))
            np.testing.assert_allclose(x, x_ref, rtol=0, atol=1e-9)
        assert len(found.poses) == len(references) + 1
        arrows = [a.pose for a in markers.decode(drawn[step]) if isinstance(a, markers.Arrow)]
        np.testing.assert_allclose(arrows, vehicles.poses(s)[: len(vehicles)], atol=1e-9)
        if kinds == "ff":  # the rates are those at which the next pose is reached
            turns = np.diff(np.unwrap(found.poses[..., 2], axis=0), axis=0)
            rates = watcher.scenario.dt * found.twists[:-1, :, 2]
            np.testing.assert_allclose(turns, rates, rtol=0, atol=1e-9)


def test_pictures_are_made_only_for_subscribers(
    make_watcher: WatcherFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    for owner, name in ((Scene, "shapes"), (markers, "encode"), (equilibrium, "encode")):
        make = getattr(owner, name)
        monkeypatch.setattr(owner, name, lambda *a, make=make: made.append(make) or make(*a))
    watcher = make_watcher()
    x, u = walk(watcher, 1)
    watcher.see(0, x[0])
    assert not made
    # A late subscriber is shown the present state, and gets no path, because there is none.
    drawn = watcher.world.hear(MarkerArray, "markers", qos.LATEST)
    paths = watcher.world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.LATEST)
    again = watcher.world.hear(Float64MultiArray, "belief", qos.STREAM)
    watcher.world.until(lambda: again and drawn)
    watcher.world.spin(0.2)
    assert (len(drawn), len(paths), len(made)) == (1, 0, 2)
    watcher.see(1, x[1], u[1])
    watcher.world.until(lambda: len(drawn) == 2 and paths)
    assert len(made) == 5
    shapes = markers.decode(drawn[1])
    names, particles = watcher.game.players.names, len(watcher.beliefs[1].ids)
    arrows = [shape for shape in shapes if isinstance(shape, markers.Arrow)]
    lines = [shape for shape in shapes if isinstance(shape, markers.Path)]
    assert [arrow.namespace for arrow in arrows] == [f"players/{name}" for name in names]
    for i, arrow in enumerate(arrows):
        np.testing.assert_allclose(arrow.pose, x[1][4 * i : 4 * i + 3], rtol=0, atol=1e-9)
    for name in names:
        own = [line for line in lines if line.namespace == f"particles/{name}"]
        assert sorted(line.number for line in own) == sorted(watcher.beliefs[1].ids)
        assert len(own) == particles
        (bold,) = (line for line in lines if line.namespace == f"map/{name}")
        # Particles are drawn by fewer points, from the same start to the same end.
        assert any(
            len(line.points) < len(bold.points)
            and np.array_equal(line.points[[0, -1]], bold.points[[0, -1]])
            for line in own
        )


@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_states_that_waited_are_not_drawn_in_realtime(
    time: str, make_world: Callable[[], Any], wire: Any, scenario_file: ScenarioFile
) -> None:
    # Of a step as long as this, a tenth is long enough for a state to be handled in time.
    scenario = scenario_file("uu", dt=5.0, steps=100)
    watcher = Watcher(make_world(), wire, scenario, seed=3, time=time)
    drawn = watcher.world.hear(MarkerArray, "markers", qos.STREAM)
    x = watcher.scenario.initial_state
    watcher.see(0, x)
    watcher.world.until(lambda: len(drawn) == 1)
    watcher.see_all([watcher.wire.state(step, x) for step in range(1, 6)], wait=0.6)
    assert len(watcher.beliefs) == 6
    watcher.see(6, x)
    watcher.world.until(lambda: len(drawn) == (2 if time == "realtime" else 7))
    # The past path leads through states that were not drawn, too: 0, 5 and 6.
    (past,) = (shape for shape in markers.decode(drawn[-1]) if shape.namespace == "past/robot")
    assert len(past.points) == 3


def test_without_an_equilibrium_all_brake(
    make_world: Callable[[], Any], wire: Any, scenario_file: ScenarioFile
) -> None:
    path = scenario_file("uu")
    content = yaml_text.load(path.read_text())
    # No iteration moves a state by as little as this.
    content["solver"] = {"max_iterations": 1, "converged_movement": 1e-300}
    path.write_text(yaml_text.dump(content))
    world = make_world()
    recorder = world.add(Recorder, scenario=path)
    world.add(RobotPlanner, scenario=path)
    watcher = Watcher(world, wire, path, seed=3)
    heard = world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    commands = world.hear(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    x = watcher.scenario.initial_state
    u = np.zeros(4)
    for step in range(3):
        watcher.see(step, x, u)
        told, summary = watcher.strategies[step], watcher.beliefs[step]
        report = watcher.reports[step]
        assert told.particle == summary.map == -1
        assert not summary.settled.any()
        assert report.level == diagnostics.WARN
        assert "no equilibrium is known" in report.message
        assert report.values["map"] == "-1"
        assert report.values["settled_particles"] == "0"
        assert float(report.values["map_probability"]) == 0.0
        u[:2] = told.u_ref[0] - told.P[0] @ (x - told.x_ref[0])
        x = watcher.game.step(x, u)
        assert x[3] == pytest.approx(0.0, abs=1e-9), "the robot stands still"
    # The others understand it.
    world.until(lambda: len(heard) == len(commands) == len(recorder.record.maps) == 3)
    assert recorder.record.maps == {0: -1, 1: -1, 2: -1}
    for message in commands:
        velocity = cmd_vel.decode(message, "robot")
        np.testing.assert_allclose(velocity, 0.0, rtol=0, atol=1e-9)
