"""The inference node when states are missing or late, and time is short."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rcl_interfaces.msg import Log
from trajectory_msgs.msg import MultiDOFJointTrajectory
from watcher import Watcher, WatcherFactory, walk

from msg_adapters import diagnostics, qos


def test_the_node_reports_missing_states_and_continues(make_watcher: WatcherFactory) -> None:
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
    assert watcher.steps(watcher.beliefs)[1] == watcher.steps(watcher.strategies)[1] == 3
    watcher.see(4, x[4], u[4])
    assert watcher.steps(watcher.beliefs)[2] == 4
    assert not np.array_equal(watcher.beliefs[2].weights, before)


@pytest.mark.parametrize("gap", [4, 5, 6, 7, 20])
@pytest.mark.parametrize("seen", [False, True])
def test_the_node_continues_after_a_gap_as_long_as_the_horizon(
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
    assert watcher.steps(watcher.strategies) == [0, gap, gap + 1]
    assert watcher.steps(watcher.beliefs) == [0, gap, gap + 1]
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
    assert watcher.steps(watcher.beliefs) == list(range(15))
    assert int(watcher.reports[-1].values["missed_deadlines"]) > 0


def test_in_realtime_a_late_node_publishes_only_what_follows_from_the_newest_state(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(time="realtime", particles=6)
    x, u = walk(watcher, 30)
    watcher.world.remove(watcher.node)
    for step in range(30):
        watcher._states.publish(watcher.wire.state(step, x[step], u[step]))
    watcher.restart()
    watcher.world.until(lambda: watcher.beliefs)
    watcher.world.spin(0.2)
    assert watcher.steps(watcher.beliefs) == [29]
    assert watcher.steps(watcher.strategies) == [29]
    assert np.ptp(watcher.beliefs[0].weights) > 0, "the states were not weighed"
    watcher.world.send(watcher._states, watcher.wire.state(30, x[30], u[30]))
    watcher.world.until(lambda: len(watcher.beliefs) == 2)
    assert watcher.steps(watcher.beliefs)[1] == 30


def test_in_lockstep_a_late_node_has_the_belief_that_it_would_have_had(
    make_watcher: WatcherFactory,
) -> None:
    watcher = make_watcher(particles=6, duplicate_tolerance=0.01)
    for step, (x, u) in enumerate(zip(*walk(watcher, 12), strict=True)):
        watcher.see(step, x, u)
    before = messages(watcher)
    for heard in (watcher._beliefs, watcher._strategies):
        heard.clear()
    watcher.world.remove(watcher.node)
    watcher.restart()
    watcher.world.until(lambda: len(watcher.beliefs) == len(watcher.strategies) == 13)
    assert messages(watcher) == before


def messages(watcher: Watcher) -> list[Any]:
    return [
        *([array.tobytes() for array in (b.ids, b.weights, b.settled, b.costs)]
          for b in watcher.beliefs),
        *([array.tobytes() for array in (s.u_ref, s.P, s.x_ref)] for s in watcher.strategies),
        *((b.stamp, b.map) for b in watcher.beliefs),
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
        assert watcher.steps([told, summary]) == [int(values["step"]), step]
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
