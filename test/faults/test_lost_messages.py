"""Messages that are lost, late, doubled or in another order on their way between processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from faulty_stack import DELAY, DROP, DUPLICATE, PASS, RELAYED, REORDER, FaultyStack
from ros_domain import free_domain

#: Steps after which the robot stands when it hears nothing more: it begins to brake 0.5 s after the
#: last state, or 1 s after the last strategy.
STANDS_AFTER = {"joint_state": 15, "robot_strategy": 20, "robot/control": 15}


@pytest.fixture
def start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forked_nodes: None
) -> Iterator[Callable[..., FaultyStack]]:
    domain = free_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    stacks: list[FaultyStack] = []

    def make(**options: object) -> FaultyStack:
        stacks.append(FaultyStack(tmp_path / f"stack_{len(stacks)}", domain, **options))
        return stacks[-1]

    yield make
    for stack in stacks:
        stack.end()


def test_a_robot_that_hears_nothing_stops_and_goes_on_when_it_hears_again(
    start: Callable[..., FaultyStack],
) -> None:
    stack = start()
    stack.until(lambda: stack.step >= 10)
    for topic, bound in STANDS_AFTER.items():
        stack.until(lambda: stack.speeds[-1] > 0.1)
        stack.relay.modes[topic] = DROP
        begin = stack.step
        stack.for_steps(bound + 10)
        assert stack.speeds[begin + bound :].max() < 0.01, topic
        stack.relay.modes[topic] = PASS
        stack.until(lambda: stack.speeds[-1] > 0.1)
    assert np.isfinite(stack.inputs).all()


def test_a_robot_goes_on_when_messages_are_late_doubled_or_in_another_order(
    start: Callable[..., FaultyStack],
) -> None:
    stack = start()
    stack.until(lambda: stack.step >= 10 and stack.speeds[-1] > 0.1)
    for mode in (DUPLICATE, REORDER, DELAY):
        begin = stack.step
        stack.relay.modes = dict.fromkeys(RELAYED, mode)
        stack.for_steps(25)
        if mode == DUPLICATE:  # who reacts to what was long ago may swing
            assert stack.speeds[begin:].min() > 0.1
    stack.relay.modes = dict.fromkeys(RELAYED, PASS)
    stack.until(lambda: not stack.robot_is_late and stack.speeds[-1] > 0.1)
    assert np.isfinite(stack.inputs).all()


def test_nodes_may_start_in_any_order_and_long_apart(start: Callable[..., FaultyStack]) -> None:
    order = ("human_1_agent", "robot_planner", "inference", "simulator")
    stack = start(order=order, gap=3.0)
    stack.until(lambda: stack.step >= 20)
    assert not np.isnan(np.array(stack.recorder.record.states)).any()
    assert stack.speeds[-1] > 0.1
    assert min(stack.recorder.record.beliefs) == 0
