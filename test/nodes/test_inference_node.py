"""The inference node: what it weighs, and what it tells."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import TwistStamped
from rcl_interfaces.msg import Log
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray

from gameinfer_ros.inference import Belief
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.scene import Scene
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ
from msg_adapters import belief, cmd_vel, diagnostics, equilibrium, markers, qos, strategy


class Watcher:
    """An inference node, with the test in the place of the simulator and the planner."""

    def __init__(self, world: Any, wire: Any, scenario: str | Path, **parameters: Any) -> None:
        self.world, self.scenario = world, Scenario.load(scenario)
        self.wire, self.game = wire(self.scenario), self.scenario.game
        self._parameters = {"scenario": scenario, **parameters}
        self.node = world.add(Inference, **self._parameters)
        self.reports: list[diagnostics.Status] = world.reports(self.node)
        self._states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)
        self._strategies = world.hear(Float64MultiArray, "map_strategy", qos.STREAM)
        self._beliefs = world.hear(Float64MultiArray, "belief", qos.STREAM)

    def start_anew(self) -> None:
        """Have another node in the place of one that was removed."""
        self.node = self.world.add(Inference, **self._parameters)

    def see(self, step: int, x: np.ndarray, u: np.ndarray | None = None) -> None:
        """Show a state and wait for the report on it."""
        count = len(self.reports)
        self.world.send(self._states, self.wire.state(step, x, u))
        self.world.until(
            lambda: (
                len(self.reports) > count
                and len(self._beliefs) >= len(self.reports)
                and len(self._strategies) >= len(self.reports)
            )
        )

    def see_all(self, messages: list[MultiDOFJointState], wait: float | None = None) -> None:
        """Show states at once, and wait for the reports and beliefs once they are old."""
        count = len(self.reports) + len(messages)
        for message in messages:
            self._states.publish(message)
        time.sleep(3 * self.scenario.dt if wait is None else wait)
        self.world.until(lambda: len(self.reports) >= count and len(self._beliefs) >= count)

    @property
    def beliefs(self) -> list[belief.BeliefSummary]:
        players, dt = len(self.game.players), self.scenario.dt
        return [belief.decode(message, players, dt) for message in self._beliefs]

    @property
    def strategies(self) -> list[strategy.AffineStrategy]:
        nx, dt = self.game.players.n_states, self.scenario.dt
        return [strategy.decode(message, 2, nx, dt) for message in self._strategies]


WatcherFactory = Callable[..., Watcher]


@pytest.fixture
def make_watcher(
    make_world: Callable[[], Any], wire: Any, scenario_file: Callable[..., Path]
) -> WatcherFactory:
    def make(
        kinds: str = "uu",
        horizon: int = 10,
        duplicate_tolerance: float = 0.0,
        **parameters: Any,
    ) -> Watcher:
        scenario = scenario_file(kinds, horizon=horizon, duplicate_tolerance=duplicate_tolerance)
        return Watcher(make_world(), wire, scenario, seed=3, **parameters)

    return make


def walk(watcher: Watcher, steps: int = 4) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """States and inputs of players who turn and accelerate a little."""
    rng = np.random.default_rng(7)
    x, u = [watcher.scenario.initial_state], [np.zeros(watcher.game.players.n_inputs)]
    for _ in range(steps):
        u.append(rng.uniform(-0.3, 0.3, len(u[0])))
        x.append(watcher.game.step(x[-1], u[-1]))
    return x, u


@pytest.mark.parametrize("robot_plays", [True, False])
def test_it_tells_the_belief_of_the_core(robot_plays: bool, make_watcher: WatcherFactory) -> None:
    watcher = make_watcher(robot_plays=robot_plays, particles=6, duplicate_tolerance=0.01)
    x, u = walk(watcher)
    scenario, own = watcher.scenario, slice(0, 2)
    core = Belief(
        IterativeLQ(watcher.game, scenario.solver),
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
        assert found.step == told.step == step
        np.testing.assert_array_equal(found.ids, core.ids)
        np.testing.assert_allclose(found.weights, core.weights, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found.costs, core.costs.T, rtol=1e-6)
        np.testing.assert_array_equal(found.settled, core.settled)
        assert found.weights.sum() == pytest.approx(1.0, abs=1e-9)
        assert told.particle == found.map == core.ids[core.map]
        # The horizon starts at the state, though it was solved from the one before.
        reaction = told.u_ref[0] - told.P[0] @ (state - told.x_ref[0])
        expected = core.strategy.inputs(step, state)[own, core.map]
        np.testing.assert_allclose(reaction, expected, rtol=1e-6, atol=1e-9)
        if step:
            core.solve(step, state)
    assert any(1 < len(found.ids) < 6 for found in watcher.beliefs)  # some were duplicates


@pytest.mark.parametrize("robot_plays", [True, False])
def test_where_the_robot_is_tells_of_the_equilibrium_only_if_it_does_not_play(
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


def test_the_map_equilibrium_is_the_trajectory_of_all_players(make_watcher: WatcherFactory) -> None:
    watcher = make_watcher("ud")
    heard = watcher.world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    names, vehicles = watcher.game.players.names, watcher.scenario.vehicles
    for step, (x, u) in enumerate(zip(*walk(watcher, 2), strict=True)):
        watcher.see(step, x, u)
        watcher.world.until(lambda step=step: len(heard) > step)
        found = equilibrium.decode(heard[step], names, watcher.scenario.dt)
        assert found.step == step
        references = watcher.strategies[step].x_ref
        for k, x_ref in enumerate(references):
            state = vehicles.state(found.poses[k], found.twists[k])
            np.testing.assert_allclose(state, x_ref, rtol=0, atol=1e-9)
        assert len(found.poses) == len(references) + 1


def test_pictures_are_made_only_for_somebody_to_see(
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
    # Whoever joins late is shown the present state, and gets no path, because there is none.
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
    time: str, make_world: Callable[[], Any], wire: Any, scenario_file: Callable[..., Path]
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


def test_missing_states_are_told_and_got_over(make_watcher: WatcherFactory) -> None:
    watcher = make_watcher()
    log = watcher.world.hear(Log, "/rosout", qos.STREAM)
    x, u = walk(watcher)
    watcher.see(0, x[0])
    before = watcher.beliefs[0].weights
    watcher.see(3, x[3], u[3])
    watcher.world.until(lambda: any("missing" in line.msg for line in log))
    (words,) = (line.msg for line in log if "missing" in line.msg)
    assert "1 to 2" in words
    # Nothing was weighed, and the robot has a strategy for now.
    np.testing.assert_array_equal(watcher.beliefs[1].weights, before)
    assert watcher.beliefs[1].step == watcher.strategies[1].step == 3
    watcher.see(4, x[4], u[4])
    assert watcher.beliefs[2].step == 4
    assert not np.array_equal(watcher.beliefs[2].weights, before)


@pytest.mark.parametrize("gap", [4, 5, 6, 7, 20])
@pytest.mark.parametrize("seen", [False, True])
def test_a_gap_as_long_as_the_horizon_is_got_over(
    gap: int, seen: bool, make_watcher: WatcherFactory
) -> None:
    watcher = make_watcher(horizon=5)
    heard = []
    if seen:
        heard = watcher.world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    x, u = walk(watcher, 2)
    watcher.see(0, x[0])
    watcher.see(gap, x[1], u[1])
    watcher.see(gap + 1, x[2], u[2])
    assert [told.step for told in watcher.strategies] == [0, gap, gap + 1]
    assert [found.step for found in watcher.beliefs] == [0, gap, gap + 1]
    if seen:
        watcher.world.until(lambda: len(heard) == 3)


def test_in_realtime_what_waited_too_long_is_weighed_but_not_solved(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(horizon=5, time="realtime")
    x, u = walk(watcher, 1)
    watcher.see(0, x[0])
    # All others are there before the node handles the first: each has waited for longer than dt.
    watcher.see_all([watcher.wire.state(step, x[1], u[1]) for step in range(1, 15)])
    assert [int(status.values["step"]) for status in watcher.reports] == list(range(15))
    assert [found.step for found in watcher.beliefs] == list(range(15))
    assert int(watcher.reports[-1].values["missed_deadlines"]) > 0


def test_in_realtime_a_node_that_comes_late_tells_only_what_follows_from_the_newest_state(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(time="realtime", particles=6)
    x, u = walk(watcher, 30)
    watcher.world.remove(watcher.node)
    for step in range(30):
        watcher._states.publish(watcher.wire.state(step, x[step], u[step]))
    watcher.start_anew()
    watcher.world.until(lambda: watcher.beliefs)
    watcher.world.spin(0.2)
    assert [found.step for found in watcher.beliefs] == [29]
    assert [found.step for found in watcher.strategies] == [29]
    assert np.ptp(watcher.beliefs[0].weights) > 0, "the states were not weighed"
    watcher.world.send(watcher._states, watcher.wire.state(30, x[30], u[30]))
    watcher.world.until(lambda: len(watcher.beliefs) == 2)
    assert watcher.beliefs[1].step == 30


def test_in_lockstep_a_node_that_comes_late_has_the_belief_that_it_would_have_had(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(particles=6, duplicate_tolerance=0.01)
    for step, (x, u) in enumerate(zip(*walk(watcher, 12), strict=True)):
        watcher.see(step, x, u)
    before = messages(watcher)
    for heard in (watcher._beliefs, watcher._strategies):
        heard.clear()
    watcher.world.remove(watcher.node)
    watcher.start_anew()
    watcher.world.until(lambda: len(watcher.beliefs) == len(watcher.strategies) == 13)
    assert messages(watcher) == before


def messages(watcher: Watcher) -> list[Any]:
    """All that a watcher has been told, to the bit."""
    return [
        *([array.tobytes() for array in (b.ids, b.weights, b.settled, b.costs)]
          for b in watcher.beliefs),
        *([array.tobytes() for array in (s.u_ref, s.P, s.x_ref)] for s in watcher.strategies),
        *((b.step, b.map) for b in watcher.beliefs),
    ]  # fmt: skip


@pytest.mark.parametrize("parameters", [{"deadline": 1e-6}, {"threads": 2}, {"threads": 1}])
def test_in_lockstep_neither_a_deadline_nor_threads_make_a_difference(
    parameters: dict[str, Any], make_watcher: WatcherFactory
) -> None:
    watchers = [make_watcher(particles=12, **more) for more in ({}, parameters)]
    for watcher in watchers:
        for step, (x, u) in enumerate(zip(*walk(watcher, 3), strict=True)):
            watcher.see(step, x, u)
            told = watcher.reports[step].values
            assert told["updated_particles"] == told["particles"] == "12"
            assert told["missed_deadlines"] == "0"
    one, other = map(messages, watchers)
    assert one == other


def test_in_realtime_a_tiny_deadline_leaves_everything_as_it_was_first_solved(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(time="realtime", deadline=1e-6, particles=6)
    for step, (x, u) in enumerate(zip(*walk(watcher), strict=True)):
        watcher.see(step, x, u)
    first = watcher.strategies[0]
    for step in range(5):
        told, report = watcher.strategies[step], watcher.reports[step]
        summary, values = watcher.beliefs[step], report.values
        assert told.step == summary.step == int(values["step"]) == step
        assert values["particles"] == "6"
        assert values["updated_particles"] == ("0" if step else "6")
        assert values["missed_deadlines"] == str(step)
        assert (report.level == diagnostics.OK) == (step == 0)
        assert ("not reached in time" in report.message) == (step > 0)
        # The weights go with the states, and the strategy is one of those solved at first.
        assert summary.weights.sum() == pytest.approx(1.0)
        for array in (summary.weights, summary.costs, told.u_ref, told.P, told.x_ref):
            assert np.isfinite(array).all()
        assert len(told.u_ref) == 10 - step
        assert values["map"] == str(summary.map) == str(told.particle)
        if told.particle == first.particle:
            np.testing.assert_array_equal(told.u_ref, first.u_ref[step:])
            np.testing.assert_array_equal(told.P, first.P[step:])
            np.testing.assert_array_equal(told.x_ref, first.x_ref[step:])
    assert np.ptp(watcher.beliefs[0].weights) == pytest.approx(0.0)
    assert np.ptp(watcher.beliefs[4].weights) > 1e-3
    # Past the horizon nothing is known any more: then everything is solved, however long it takes.
    watcher.see(10, x)
    assert watcher.reports[5].values["updated_particles"] == "6"
    assert watcher.reports[5].level == diagnostics.OK
    assert len(watcher.strategies[5].u_ref) == 10


def test_without_an_equilibrium_all_are_told_to_brake(
    make_world: Callable[[], Any], wire: Any, scenario_file: Callable[..., Path]
) -> None:
    path = scenario_file("uu")
    content = yaml.safe_load(path.read_text())
    # No iteration moves a state by as little as this.
    content["solver"] = {"max_iterations": 1, "converged_movement": 1e-300}
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    world = make_world()
    record = world.add(Recorder, scenario=path).record
    world.add(RobotPlanner, scenario=path)
    watcher = Watcher(world, wire, path, seed=3)
    heard = world.hear(MultiDOFJointTrajectory, "map_equilibrium", qos.STREAM)
    commands = world.hear(TwistStamped, "robot/cmd_vel", qos.COMMAND)
    x = watcher.scenario.initial_state
    u = np.zeros(4)
    for step in range(3):
        watcher.see(step, x, u)
        told, summary, report = (
            watcher.strategies[step],
            watcher.beliefs[step],
            watcher.reports[step],
        )
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
    world.until(lambda: len(heard) == len(commands) == len(record.maps) == 3)
    assert record.maps == {0: -1, 1: -1, 2: -1}
    for message in commands:
        velocity = cmd_vel.decode(message, "robot")
        np.testing.assert_allclose(velocity, 0.0, rtol=0, atol=1e-9)


def test_the_heading_of_the_scenario_is_meant_beyond_a_half_turn(
    make_world: Callable[[], Any], wire: Any, scenario_file: Callable[..., Path]
) -> None:
    one = Watcher(make_world(), wire, scenario_file("uu", heading=7.0), particles=2)
    one.see(0, one.scenario.initial_state)
    np.testing.assert_allclose(
        one.strategies[0].x_ref[0], one.scenario.initial_state, rtol=0, atol=1e-12
    )
