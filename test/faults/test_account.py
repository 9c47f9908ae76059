"""What the campaign of faults learns from its witness, and what breaks its promises."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from passing import write_scenario
from rclpy.node import Node
from ros_domain import free_domain
from run_command import DEADLINE

sys.path.append(str(Path(__file__).parents[2] / "benchmarks/faults"))

from account import Account, BrokenPromiseError, Plan, Report, Seen
from witness import Bystander

from gameinfer_ros.scenario import Scenario
from msg_adapters import MessageError

#: Speed at step 10, in m/s, which no earlier state contains.
SPEED = 1.0


@pytest.fixture
def account(tmp_path: Path) -> Account:
    """Of a robot that hears of nothing after step 10, at which it makes a plan of five inputs."""
    account = Account(Scenario.load(write_scenario(tmp_path)).vehicles)
    account.plans = [Plan(10, np.array([[0.1 * k, 1.0] for k in range(5)]), 0)]
    speeds = [SPEED + 0.1 * k for k in range(6)]
    while speeds[-1] > 0.0:
        speeds.append(max(0.0, speeds[-1] - 0.3))
    for k, speed in enumerate([*speeds, *[0.0] * 10]):
        omega = 0.1 * (k - 1) if 0 < k <= 5 else 0.0
        account.seen.append(Seen(0.1 * k, 10 + k, speed, omega, 0))
    return account


def test_it_has_the_oldest_state_and_strategy_and_when_the_robot_stood(account: Account) -> None:
    account.reports = [Report(10, 3, 0)]
    told = {"oldest_state_steps": 4, "oldest_strategy_steps": 7, "judged_inputs": 5}
    assert account.check() == told
    assert account.stood_after(0.05, 2.0, 12) == {"brake_steps": 9.0}
    assert account.stood_after(0.05, 0.5, 12) == {}, "it came back before"


def older_plan(account: Account) -> None:
    account.plans = [Plan(8, np.vstack([np.zeros((2, 2)), account.plans[0].inputs]), 0)]


def older_strategy(account: Account) -> None:
    account.reports = [Report(10, 9, 0)]


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (older_plan, "of step 14 comes from a state of 6 steps before"),
        (older_strategy, "of step 12 comes from a strategy 11 steps old"),
    ],
)
def test_what_is_too_old_breaks_a_promise(
    edit: Callable[[Account], None], words: str, account: Account
) -> None:
    edit(account)
    with pytest.raises(BrokenPromiseError, match=words):
        account.check()


def test_an_input_from_no_plan_or_beyond_limits_breaks_a_promise(account: Account) -> None:
    del account.seen[1]  # what is not known is not judged
    account.check()
    account.seen[2] = account.seen[2]._replace(omega=0.5)
    for unheard in (set(), {6}, {13}):  # none of these can be it
        account.unheard = unheard
        with pytest.raises(BrokenPromiseError, match="of step 12 comes from no plan"):
            account.check()
    account.unheard = {7}
    assert account.check()["unknown_inputs"] == 1
    account.seen[2] = account.seen[2]._replace(omega=2.5)
    with pytest.raises(BrokenPromiseError, match="of step 12 is beyond its limits"):
        account.check()


def test_a_robot_that_stands_too_late_breaks_a_promise(account: Account) -> None:
    with pytest.raises(BrokenPromiseError, match="stands after 9 steps, and not 8"):
        account.stood_after(0.05, 2.0, 8)
    account.commands = [(-0.1, 0.5), (1.0, 0.5), (1.3, 0.5), (1.4, 0.0), (3.1, 0.5)]
    assert account.base_stood_after(0.0, 3.0) == {"base_stood_s": 1.3}
    assert account.base_stood_after(0.0, 1.5) == {}, "it came back before"
    with pytest.raises(BrokenPromiseError, match=r"a base is told to move for 3\.1 s"):
        account.base_stood_after(0.0, 4.0)


@pytest.mark.parametrize(
    ("commands", "what"),
    [
        ([], "was not told to move before"),
        ([(-0.2, 0.5), (-0.1, 0.0), (1.0, 0.0)], "was not told to move before"),
        ([(-0.1, 0.5)], "is not told to stand"),
        ([(-0.1, 0.5), (1.0, 0.5)], "is not told to stand"),
        ([(-0.1, 0.5), (1.6, 0.0)], "is not told to stand"),
    ],
)
def test_a_base_that_is_not_told_to_stand_breaks_a_promise(
    account: Account, commands: list[tuple[float, float]], what: str
) -> None:
    account.commands = commands
    with pytest.raises(BrokenPromiseError, match=what):
        account.base_stood_after(0.0, 3.0)


def test_nothing_holds_of_which_too_little_was_heard(account: Account) -> None:
    account.commands = [(0.1 * k, 0.5) for k in range(5)]
    account.reports = [Report(10, 3, 0)]
    account.check(5)
    with pytest.raises(BrokenPromiseError, match="too little was heard: 5 inputs"):
        account.check(6)
    account.commands.pop()
    with pytest.raises(BrokenPromiseError, match="too few commands were heard: 4"):
        account.check(5)
    del account.seen[3:]
    with pytest.raises(BrokenPromiseError, match="only 2 of its steps were heard of"):
        account.stood_after(0.05, 5.0, 12)
    account.seen.clear()
    with pytest.raises(BrokenPromiseError, match="too little was heard: 0 inputs"):
        account.check(1)


def test_a_strategy_of_unknown_age_is_not_fresh(account: Account) -> None:
    with pytest.raises(BrokenPromiseError, match="too little was heard: 0 inputs"):
        account.check(1)
    account.seen = [Seen(0.1 * k, 10 + k, SPEED + 0.1 * k, 0.0, 0) for k in range(8)]
    account.plans = [Plan(10 + k, np.array([[0.0, 1.0]]), 0) for k in range(7)]
    with pytest.raises(BrokenPromiseError, match="of step 16 comes from a strategy of unknown age"):
        account.check()  # one report may never have been sent, but no more
    account.lost_reports = 1
    assert account.check()["unknown_ages"] == 7


def test_a_plan_of_the_run_before_explains_nothing_of_the_next_run(account: Account) -> None:
    old, account.plans = account.plans, []
    account.reports = [Report(10, 0, 0)]
    account.seen = [
        *(Seen(s.time, s.step, 0.0, 0.0, 0) for s in account.seen),
        *(s._replace(time=s.time + 9.0, run=1) for s in account.seen),
    ]
    account.plans = [plan._replace(run=1) for plan in old]
    with pytest.raises(BrokenPromiseError, match="too little was heard: 0 inputs"):
        account.check(1)  # nor does a report
    account.reports.append(Report(10, 1, 1))
    assert account.check()["oldest_strategy_steps"] == 5
    account.plans = [plan._replace(run=0) for plan in old]
    with pytest.raises(BrokenPromiseError, match="of step 10 comes from no plan"):
        account.check()


def test_neither_inertia_nor_an_old_plan_nor_an_old_strategy_is_a_restart(account: Account) -> None:
    account.reports = [Report(10, 0, 0)]
    assert account.resumed(-0.1) == pytest.approx(0.1)
    for since in (0.0, 0.25, 0.55, 1.0):  # by the plan, braking, and at rest
        assert account.resumed(since) is None
    again = np.array([[0.0, 1.0]])
    last = account.seen[-1]
    account.seen.append(Seen(last.time + 0.1, last.step + 1, 0.1, 0.0, 0))
    account.plans.append(Plan(last.step, again, 0))
    assert account.resumed(1.0) is None, "nobody knows what it follows"
    account.reports.append(Report(last.step, last.step - 20, 0))
    assert account.resumed(0.95) == account.seen[-1].time
    assert account.resumed(1.05) is None, "what it follows was there before"
    account.seen[-1] = account.seen[-1]._replace(speed=0.04)
    account.plans[-1] = account.plans[-1]._replace(inputs=0.4 * again)
    assert account.resumed(0.95) is None, "it does not move"


def test_a_failure_of_the_witness_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    called = Event()

    def fail() -> None:
        called.set()
        raise MessageError("stamp: it cannot be read")

    def make(**node_options: Any) -> Node:
        node = Node("witness", **node_options)
        node.create_timer(0.01, fail)
        return node

    bystander = Bystander(free_domain(), make)
    assert called.wait(DEADLINE)
    with pytest.raises(MessageError, match="stamp: it cannot be read"):
        bystander.end()
    bystander.end()  # which is told once
