"""External players: observed at each step, missing, and back again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from arena import EPOCH, TWIST, Arena, circle, time_of
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from small_scenario import ScenarioFile
from std_srvs.srv import SetBool
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.world import state_publisher
from gameinfer_ros.nodes.world.external_clock import MOST_LEFT_OUT
from gameinfer_ros.runs.run_clock import EarlyError, RunClock
from msg_adapters import diagnostics, qos

Open = Callable[..., Arena]


@pytest.fixture
def open_arena(world: Any, wire: Any, scenario_file: ScenarioFile) -> Open:
    def make(kinds: str, external: str, steps: int = 20, **parameters: Any) -> Arena:
        return Arena(world, wire, scenario_file(kinds, steps=steps), external, **parameters)

    return make


def test_players_are_observed_at_each_step_whatever_their_rates(open_arena: Open) -> None:
    arena = open_arena("uuu", "human_1, human_2", steps=8)
    arena.begin("human_1", "human_2")
    periods, next_word = {"human_1": 0.013, "human_2": 0.17}, {"human_1": 0.013, "human_2": 0.17}
    for time in np.arange(0.01, 0.9, 0.01):
        for player, due in next_word.items():
            if time >= due:
                arena.tell(player, due)
                next_word[player] += periods[player]
        arena.set_clock(float(time))
    arena.world.until(lambda: arena.node.done)
    arena.world.until(lambda: len(arena.states) == 9)
    for step, state in arena.states.items():
        for i in (1, 2):
            pose = circle(step * arena.dt)
            np.testing.assert_allclose(state.poses[i], pose, atol=2e-3)
            np.testing.assert_allclose(state.twists[i, :2], TWIST[:2], atol=1e-9)
        if step > 0:  # what explains how it came here
            np.testing.assert_allclose(state.twists[1:, 2], TWIST[2], atol=1e-2)
            np.testing.assert_allclose(state.accelerations[1:], 0.0, atol=1e-2)
        # The robot gets no control: it brakes and stands.
        assert state.twists[0, 0] == pytest.approx(0.5 if step == 0 else 0.0, abs=1e-12)
    assert arena.reports[-1].values["human_1/odom_age_s"] != "none"


def test_a_simulated_player_takes_part_as_ever(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", steps=3)
    hand = arena.world.publisher(MultiDOFJointTrajectory, "robot/control", qos.LATEST)
    arena.begin("human_1")
    x = arena.scenario.initial_vehicle_state
    for step in range(3):
        arena.world.send(hand, arena.wire.control("robot", step, [0.3, 0.2]))
        arena.go("human_1", arena.dt * (step + 1))
        arena.world.until(lambda step=step: step + 1 in arena.states)
        x = arena.scenario.vehicles.step(x, np.array([0.3, 0.2, 0.0, 0.0]))
        found = arena.states[step + 1].poses[0]
        np.testing.assert_allclose(found, x[:3], atol=1e-12)
    assert {report.values["late_steps"] for report in arena.reports[-3:]} == {"0"}


def test_a_player_that_is_lost_is_waited_for_while_steps_go_on(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", steps=30, odom_timeout=0.45)
    arena.begin("human_1")
    for step in range(1, 4):
        arena.go("human_1", arena.dt * step)
    arena.world.until(lambda: 3 in arena.states)
    for step in range(4, 16):  # silence
        arena.set_clock(arena.dt * step)
    arena.world.until(arena.say("missing: human_1 (no odometry for "))
    assert arena.reports[-1].level == diagnostics.WARN
    assert arena.reports[-1].values["idle"] == "no odometry of human_1"
    late = arena.reports[-1].values["late_steps"]
    known = set(arena.states)
    # For 0.45 s after its last word, it was still taken to go on.
    assert known == set(range(8))
    np.testing.assert_allclose(arena.states[7].poses[1], circle(0.7), atol=1e-3)
    for step in range(16, 19):
        arena.go("human_1", arena.dt * step)
    arena.world.until(lambda: 18 in arena.states)
    assert set(arena.states) == {*range(8), 16, 17, 18}
    # No player is late for an unknown state.
    assert int(late) <= 8
    np.testing.assert_allclose(arena.states[17].poses[1], circle(1.7), atol=1e-3)
    assert "missing" not in arena.reports[-1].message


def test_a_run_does_not_end_while_a_player_is_missing(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", steps=6, odom_timeout=0.45)
    arena.begin("human_1")
    for step in range(1, 10):
        arena.set_clock(arena.dt * step)
    arena.world.until(arena.say("missing"))
    assert not arena.node.done
    arena.go("human_1", 1.0)
    arena.world.until(lambda: arena.node.done)
    arena.world.until(lambda: 10 in arena.states)
    assert not {6, 7, 8, 9} & set(arena.states)


def test_odom_timeout_can_change(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", odom_timeout=0.15)
    arena.begin("human_1")
    arena.set_clock(0.1)
    arena.world.until(lambda: 1 in arena.states)
    arena.set_clock(0.2)
    arena.world.until(arena.say("missing: human_1"))
    assert 2 not in arena.states


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda m: setattr(m.header, "frame_id", "odom"), "'odom' is not allowed: 'map'"),
        (lambda m: setattr(m.header, "stamp", time_of(EPOCH - 60)), "60.0 s behind"),
        (lambda m: setattr(m.header, "stamp", time_of(EPOCH + 60)), "60.0 s ahead of"),
        (lambda m: setattr(m.pose.pose.position, "x", float("nan")), "not a finite number"),
    ],
)
def test_odometry_that_cannot_be_used_is_refused_and_the_run_waits(
    edit: Callable[[Odometry], None],
    words: str,
    open_arena: Open,
    capfd: pytest.CaptureFixture[str],
) -> None:
    arena = open_arena("uu", "human_1")
    arena.set_clock(0.0)
    arena.tell("human_1", 0.0, edit=edit)
    arena.world.until(arena.say("waits for human_1 (no odometry yet)"))
    assert not arena.states
    assert arena.reports[-1].values["rejected_messages"] == "1"
    errors = capfd.readouterr().err
    assert "human_1/odom" in errors and words in errors


def test_by_arrival_stamps_do_not_matter(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", odom_time="arrival")
    arena.set_clock(0.0)
    arena.tell("human_1", -500.0)
    arena.world.until(lambda: 0 in arena.states)


@pytest.mark.parametrize("profile", [qos.SENSOR, qos.LATEST, qos.COMMAND])
def test_odometry_arrives_with_any_quality_of_service(
    profile: QoSProfile, open_arena: Open
) -> None:
    arena = open_arena("uu", "human_1")
    arena.set_clock(0.0)
    arena.tell("human_1", 0.0, profile)
    arena.world.until(lambda: 0 in arena.states)


def test_when_its_clock_is_set_back_the_run_restarts(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1")
    arena.begin("human_1")
    arena.set_clock(0.1)
    arena.world.until(lambda: 1 in arena.states)
    arena.set_clock(-20.0)
    arena.set_clock(-19.9)
    arena.world.until(arena.say("waits for human_1 (no odometry yet)"))
    heard = len(arena._heard)
    arena.tell("human_1", -19.9)
    arena.world.until(lambda: len(arena._heard) > heard)
    assert arena.restarts(heard, -19.9)


def test_a_clock_that_is_set_back_a_little_is_noticed_too(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1")
    arena.begin("human_1")
    for time in (0.1, 0.2, 0.3):
        arena.go("human_1", time)
    arena.world.until(lambda: 3 in arena.states)
    heard = len(arena._heard)
    for time in (0.1, 0.2):
        arena.set_clock(time)
        arena.tell("human_1", time)
    arena.world.until(lambda: len(arena._heard) > heard)
    assert arena.restarts(heard, 0.1)


def test_a_clock_that_restarts_after_the_end_leads_to_a_run_when_it_is_reset(
    open_arena: Open,
) -> None:
    arena = open_arena("uu", "human_1", steps=2)
    arena.begin("human_1")
    arena.go("human_1", 0.2)
    arena.world.until(lambda: arena.node.done)
    arena.set_clock(-500.0)
    arena.node.begin()
    heard = len(arena._heard)
    arena.tell("human_1", -500.0)
    arena.world.until(lambda: len(arena._heard) > heard)


def test_runs_on_a_coarse_clock_are_told_apart(
    open_arena: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = iter([100, 700])
    monkeypatch.setattr(state_publisher, "time_ns", lambda: next(times))
    arena = open_arena("uu", "human_1")
    arena.begin("human_1")
    arena.go("human_1", 0.5)
    arena.world.until(lambda: 5 in arena.states)
    first, heard = RunClock(arena.dt), len(arena._heard)
    first.start = arena.node.clock.start
    arena.node.begin()
    arena.world.until(lambda: len(arena._heard) > heard)
    assert arena.restarts(heard, 0.5)
    with pytest.raises(EarlyError):  # five steps later, and yet of another run
        first.step(arena.node.clock.stamp(0))


def test_when_its_clock_jumps_ahead_steps_are_left_out(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", steps=10**8)
    arena.begin("human_1")
    arena.set_clock(5e4)
    arena.tell("human_1", 5e4)
    arena.set_clock(5e4 + 0.1)
    arena.world.until(lambda: max(arena.states) >= 500_000)
    assert len(arena.states) < 50


def go_on(arena: Arena, first: int) -> None:
    """Tell of human_1 at each step from one on, until the run is over."""
    for step in range(first, first + 20):
        if arena.node.done:
            return
        arena.set_clock(arena.dt * step)
        arena.tell("human_1", arena.dt * step)
        arena.world.spin(0.1)
    raise AssertionError("the run is not over")


@pytest.mark.parametrize("jump", [25, 60, 10_000])
def test_a_run_ends_when_its_clock_jumps_past_its_last_step(open_arena: Open, jump: int) -> None:
    arena = open_arena("uu", "human_1", steps=10)
    recorder = arena.add_recorder()
    arena.begin("human_1")
    arena.go("human_1", 0.1)
    arena.world.until(lambda: recorder.record.steps == 1)
    go_on(arena, 1 + jump)
    last = arena.node.world.step
    assert 1 + jump <= last <= 1 + jump + 1
    arena.world.until(lambda: last in arena.states)
    # Whoever records it knows that it is over.
    arena.world.until(lambda: recorder.record.steps == last)
    arena.world.until(lambda: recorder.figures["/simulator"]["step"] == str(last - 1))
    assert np.isfinite(recorder.record.states[-1]).all()


def test_a_run_ends_when_a_player_is_back_long_after_its_last_step(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1", steps=10)
    recorder = arena.add_recorder()
    arena.begin("human_1")
    absent = range(10, 90, 10)
    for step in absent:
        arena.set_clock(arena.dt * step)
    arena.world.until(lambda: arena.node.world.step == absent[-1])
    assert not arena.node.done
    go_on(arena, absent[-1] + 1)
    last = arena.node.world.step
    arena.world.until(lambda: recorder.record.steps == last)


@pytest.mark.parametrize(
    "times", [[1.7e9], [4e4, 8e4, 12e4]], ids=["to the time of day", "several times"]
)
def test_a_clock_that_jumps_by_more_than_a_run_may_lack_restarts_it(
    times: list[float], open_arena: Open, capfd: pytest.CaptureFixture[str]
) -> None:
    arena = open_arena("uu", "human_1", steps=10**8)
    recorder = arena.add_recorder()
    arena.begin("human_1")
    for time in times:
        assert "the run restarts" not in capfd.readouterr().err
        for step in range(6):
            arena.set_clock(time + arena.dt * step)
            arena.tell("human_1", time + arena.dt * step)
            arena.world.spin(0.1)
    assert f"but at most {MOST_LEFT_OUT} are allowed: the run restarts" in capfd.readouterr().err
    # The recorder continues with the new run, which lacks nothing.
    arena.world.until(lambda: 0 < arena.node.world.published == recorder.record.steps)
    assert recorder.record.steps < 10 and recorder.record.missing_steps == 0


def test_a_run_waits_for_a_clock(world: Any, wire: Any, scenario_file: ScenarioFile) -> None:
    arena = Arena(world, wire, scenario_file("uu"), "human_1", odom_time="arrival")
    arena.tell("human_1", 0.0)
    arena.world.until(arena.say("/clock"))
    assert not arena.states
    arena.set_clock(0.0)
    arena.tell("human_1", 0.0)
    arena.world.until(lambda: 0 in arena.states)
    arena.world.until(arena.say("the clock has stopped"))


def test_external_players_do_not_pause(open_arena: Open) -> None:
    arena = open_arena("uu", "human_1")
    answer = arena.world.call(SetBool, "/simulator/pause", data=True)
    assert not answer.success
    assert "external players" in answer.message
