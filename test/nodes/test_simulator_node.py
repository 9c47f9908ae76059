"""The simulator: waits, steps, bridges gaps and brakes."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import yaml_text
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from table import Table

from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.runs.run_clock import EarlyError
from msg_adapters import clock, diagnostics, odometry, qos, stamp

Deal = Callable[..., Table]


@pytest.fixture
def deal(world: Any, wire: Any, scenario_file: ScenarioFile) -> Deal:
    def make(kinds: str = "du", dt: float = 0.1, steps: int = 8, **parameters: Any) -> Table:
        return Table(world, wire, scenario_file(kinds, dt=dt, steps=steps), **parameters)

    return make


def test_lockstep_waits_for_all_players_and_steps_by_their_inputs(deal: Deal) -> None:
    table = deal(steps=3)
    x, rng = table.scenario.initial_state, np.random.default_rng(0)
    table.wait(0)
    for step in range(3):
        u = rng.uniform(-1.0, 1.0, 4)
        for player, own in (("human_1", u[2:]), ("robot", u[:2])):
            table.world.spin(0.05)
            assert len(table.states) == step + 1, "a player was not waited for"
            # Only the first input is for now.
            table.play(player, step, [own, [9.0, 9.0]])
        table.wait(step + 1)
        x = table.game.step(x, u)
        np.testing.assert_allclose(table.states[-1], x, rtol=0, atol=1e-12)
    # The run is over: more inputs lead nowhere.
    for player in ("robot", "human_1"):
        table.play(player, 3, [1.0, 1.0])
    table.world.spin(0.1)
    assert len(table.states) == 4
    assert [status.values["step"] for status in table.reports] == ["0", "1", "2"]
    assert all(status.values["late_steps"] == "0" for status in table.reports)


def test_odometry_is_sent_before_the_state_to_which_others_may_react(
    world: Any, scenario_file: ScenarioFile
) -> None:
    """A node that receives the last state of a run may end it, and then no more is sent."""
    sent: dict[str, int] = {}

    def listen(message_type: Any, topic: str, profile: Any) -> None:
        def note(message: Any, info: Any) -> None:
            sent[topic] = info["source_timestamp"]

        world.tester.create_subscription(message_type, topic, note, profile)

    listen(MultiDOFJointState, "joint_state", qos.STREAM)
    for player in ("robot", "human_1"):
        listen(Odometry, f"{player}/odom", qos.RECENT)
    world.add(Simulator, scenario=scenario_file("uu"))
    world.until(lambda: len(sent) == 3)
    assert sent["joint_state"] == max(sent.values())
    assert len(set(sent.values())) == 3


def test_until_a_step_is_over_a_player_may_replace_its_inputs(deal: Deal) -> None:
    table = deal()
    table.wait(0)
    table.play("robot", 0, [1.0, 1.0])
    table.play("robot", 0, [-1.0, 0.5])
    table.play("human_1", 0, [0.0, 0.0])
    table.wait(1)
    expected = table.game.step(table.scenario.initial_state, np.array([-1.0, 0.5, 0.0, 0.0]))
    np.testing.assert_allclose(table.states[1], expected, rtol=0, atol=1e-12)


def test_inputs_for_the_future_and_stale_ones_are_refused(deal: Deal) -> None:
    table = deal()
    table.wait(0)
    u = np.array([0.2, 0.1, -0.1, 0.3])
    table.play("robot", 1, [5.0, 5.0])  # of the future
    table.play("human_1", 0, u[2:])
    table.world.spin(0.1)
    assert len(table.states) == 1
    table.play("robot", 0, u[:2])
    table.wait(1)
    x = table.game.step(table.scenario.initial_state, u)
    np.testing.assert_allclose(table.states[1], x, rtol=0, atol=1e-12)
    table.play("robot", 1, u[:2])
    table.play("robot", 0, [5.0, 5.0])  # stale
    table.play("human_1", 1, u[2:])
    table.wait(2)
    np.testing.assert_allclose(table.states[2], table.game.step(x, u), rtol=0, atol=1e-12)
    table.world.until(lambda: len(table.reports) == 2)
    assert [status.values["rejected_messages"] for status in table.reports] == ["1", "2"]


def test_the_first_state_waits_for_subscribers(world: Any, scenario_file: ScenarioFile) -> None:
    world.add(Simulator, scenario=scenario_file("d"), subscribers=2)
    first = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.spin(0.3)
    assert not first
    second = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    world.until(lambda: first and second)


def test_clock_and_odometry_agree_with_the_joint_state(deal: Deal) -> None:
    # It waits for its own subscriber, which thus misses no state.
    table = deal(subscribers=2, publish_clock=True)
    world, clocks, players = table.world, table.node.clock, table.game.players
    times = world.hear(Clock, "/clock", qos.CLOCK)
    odometries = {name: world.hear(Odometry, f"{name}/odom", qos.STREAM) for name in players.names}
    world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
    for step in range(3):
        table.wait(step)
        for name in players.names:
            world.until(lambda name=name, step=step: len(odometries[name]) > step)
            table.play(name, step, [0.3, 0.2])
    world.until(lambda: times)
    assert {clocks.step(clock.decode(message)) for message in times} <= set(range(4))
    for i, name in enumerate(players.names):
        for step, message in enumerate(odometries[name][:3]):
            at, pose, rates = odometry.decode(message)
            assert at == clocks.stamp(step)
            state = players.dynamics[i].state(pose[None], rates[None])
            expected = table.states[step][players.states(i)]
            np.testing.assert_allclose(state, expected, rtol=0, atol=1e-12)


def test_a_run_is_named_by_its_start_which_late_subscribers_receive_too(deal: Deal) -> None:
    table = deal()
    table.wait(0)
    starts = table.world.hear(Time, "run_start", qos.LATEST)
    table.world.until(lambda: starts)
    (start,) = map(stamp.decode, starts)
    assert start == stamp.decode(table.heard[0].header.stamp)
    assert abs(1e-9 * start - time.time()) < 60.0
    for player in ("robot", "human_1"):
        table.play(player, 0, [0.0, 0.0])
    table.wait(1)
    assert stamp.decode(table.heard[1].header.stamp) == start + 10**8
    table.world.until(lambda: table.reports)
    assert table.reports[0].values["run"] == stamp.text(start)


@pytest.mark.parametrize("own_clock", [False, True])
def test_a_run_starts_after_all_stamps_of_the_one_before(own_clock: bool, deal: Deal) -> None:
    # On a clock of its own, time goes on by a thousand seconds within a moment.
    table = deal(dt=10.0, steps=100, publish_clock=own_clock, use_sim_time=own_clock)
    starts = table.world.hear(Time, "run_start", qos.queued(qos.LATEST))
    times = table.world.hear(Clock, "/clock", qos.queued(qos.CLOCK)) if own_clock else []
    for run in range(1, 4):
        table.world.until(lambda run=run: len(starts) == run)
        first = len(table.heard) - 1
        for step in range(3):
            table.wait(first + step)
            for player in ("robot", "human_1"):
                table.play(player, step, [0.0, 0.0])
        table.wait(first + 3)
        table.node.begin()
    found = [stamp.decode(start) for start in starts]
    for one, other in pairwise(found):
        assert other > one + 30 * 10**9
        # No stamp of one is taken for one of the other.
        table.node.clock.start = one
        with pytest.raises(EarlyError):
            table.node.clock.step(other)
    assert sorted(map(clock.decode, times)) == list(map(clock.decode, times))
    assert abs(1e-9 * found[0] - time.time()) < 60.0


def test_by_default_no_clock_is_published(deal: Deal) -> None:
    table = deal()
    assert "/clock" not in dict(table.world.tester.get_topic_names_and_types())


def test_realtime_waits_for_the_first_inputs_of_all(deal: Deal) -> None:
    table = deal(dt=0.05, steps=3, time="realtime")
    table.wait(0)
    table.play("robot", 0, [[0.0, 0.0]] * 3)
    table.world.spin(0.3)  # six steps, if time had started
    assert len(table.states) == 1
    table.play("human_1", 0, [[0.0, 0.0]] * 3)
    table.wait(3)
    table.world.spin(0.2)
    assert len(table.states) == 4  # and not more


def test_realtime_bridges_the_silence_of_a_player_and_then_brakes(deal: Deal) -> None:
    table = deal(dt=0.5, steps=6, time="realtime")
    game, rng = table.game, np.random.default_rng(1)
    robots, plan = rng.uniform(-1.0, 1.0, (6, 2)), rng.uniform(-0.3, 0.3, (3, 2))
    table.wait(0)
    table.play("human_1", 0, plan)  # its first word is its last
    for step in range(6):
        table.wait(step)
        table.play("robot", step, robots[step])
    table.wait(6)
    table.world.until(lambda: len(table.reports) == 6)

    states, x = table.states, table.scenario.initial_state
    for step in range(6):
        # The robot is not affected; the human follows its plan, then stops, and stays.
        human = plan[step] if step < 3 else np.array([0.0, -x[7] / 0.5])
        x = game.step(x, np.concatenate([robots[step], human]))
        np.testing.assert_allclose(states[step + 1], x, rtol=0, atol=1e-12)
    assert states[3][7] > 0.1
    np.testing.assert_allclose([state[7] for state in states[4:]], 0.0, atol=1e-12)
    np.testing.assert_allclose(states[5][4:], states[6][4:], rtol=0, atol=1e-12)

    assert [status.values["human_1/late_steps"] for status in table.reports] == list("012345")
    assert {status.values["robot/late_steps"] for status in table.reports} == {"0"}
    assert [status.values["late_steps"] for status in table.reports] == list("012345")
    assert [status.level for status in table.reports] == [diagnostics.OK] + [diagnostics.WARN] * 5
    assert all("late: human_1" in status.message for status in table.reports[1:])
    assert "robot" not in table.reports[-1].message


def test_a_player_whose_plan_has_ended_brakes_within_its_limits(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    file = scenario_file("u", dt=0.2, steps=6)
    content = yaml_text.load(file.read_text())
    content["players"]["robot"]["limits"] = {"a": [-1.0, 1.0]}
    file.write_text(yaml_text.dump(content))
    table = Table(world, wire, file, time="realtime")
    table.wait(0)
    table.play("robot", 0, [0.0, 0.0])  # its first word is its last, at 0.5 m/s
    table.wait(6)
    speeds = [state[3] for state in table.states]
    np.testing.assert_allclose(speeds, [0.5, 0.5, 0.3, 0.1, 0.0, 0.0, 0.0], rtol=0, atol=1e-12)


def test_a_silent_car_brakes_and_holds_its_steering(deal: Deal) -> None:
    table = deal("cu", dt=0.2, steps=3, time="realtime")
    table.wait(0)
    table.play("robot", 0, [0.5, 0.0])  # its last inputs
    table.play("human_1", 0, [[0.0, 0.0]] * 3)
    table.wait(3)
    found = [state[3:5] for state in table.states]
    expected = [[0.5, 0.1], [0.5, 0.2], [0.0, 0.2], [0.0, 0.2]]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_realtime_takes_a_late_plan_for_what_is_left_of_it(deal: Deal) -> None:
    table = deal("d", dt=0.5, steps=3, time="realtime")
    late = np.array([[9.0, 9.0], [0.5, -0.5], [0.25, 0.1]])
    table.wait(0)
    table.play("robot", 0, [0.1, 0.2])
    table.wait(1)
    table.play("robot", 0, late)  # when its second input is due
    table.wait(3)
    x = table.scenario.initial_state
    for step, u in enumerate(([0.1, 0.2], late[1], late[2])):
        x = table.game.step(x, np.array(u))
        np.testing.assert_allclose(table.states[step + 1], x, rtol=0, atol=1e-12)
    table.world.until(lambda: len(table.reports) == 3)
    assert table.reports[-1].values["late_steps"] == "2"


@pytest.mark.parametrize("heading", [7.0, -4.0])
def test_headings_are_wrapped_on_the_wire_only(
    heading: float, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    table = Table(world, wire, scenario_file("u", heading=heading))
    x = table.scenario.initial_state
    for step in range(5):
        table.wait(step)
        table.play("robot", step, [8.0, 0.0])  # 0.8 rad in a step: through pi at some time
        x = table.game.step(x, np.array([8.0, 0.0]))
    table.wait(5)
    found = table.states[5]
    assert all(abs(state[2]) <= np.pi for state in table.states)
    np.testing.assert_allclose(found[[0, 1, 3]], x[[0, 1, 3]], rtol=0, atol=1e-12)
    assert np.cos(found[2] - x[2]) == pytest.approx(1.0, abs=1e-12)
