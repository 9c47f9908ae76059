"""What the campaign of faults is told by its witness, and what it would complain of."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from faulty_run import write_scenario

sys.path.append(str(Path(__file__).parents[2] / "benchmarks/faults"))

from account import Account, Seen
from promise import BrokenPromiseError

from gameinfer_ros.scenario import Scenario

#: Speed at step 10, in m/s, which no state before has told of.
SPEED = 1.0


@pytest.fixture
def account(tmp_path: Path) -> Account:
    """Of a robot that hears of nothing after step 10, at which it makes a plan of five inputs."""
    account = Account(Scenario.load(write_scenario(tmp_path)).vehicles)
    account.plans[10] = [np.array([[0.1 * k, 1.0] for k in range(5)])]
    speeds = [SPEED + 0.1 * k for k in range(6)]
    while speeds[-1] > 0.0:
        speeds.append(max(0.0, speeds[-1] - 0.3))
    for k, speed in enumerate([*speeds, *[0.0] * 10]):
        omega = 0.1 * (k - 1) if 0 < k <= 5 else 0.0
        account.seen.append(Seen(0.1 * k, 10 + k, speed, omega))
    return account


def test_it_tells_the_oldest_state_and_strategy_and_when_the_robot_stood(account: Account) -> None:
    account.strategy_ages[10] = 3
    assert account.check() == {"oldest_state_steps": 4, "oldest_strategy_steps": 7}
    assert account.stood_after(0.05, 2.0, 12) == {"brake_steps": 9.0}
    assert account.stood_after(0.05, 0.5, 12) == {}, "it came back before"


def test_a_state_that_is_too_old_breaks_a_promise(account: Account) -> None:
    account.plans[8] = [np.vstack([np.zeros((2, 2)), account.plans.pop(10)[0]])]
    with pytest.raises(BrokenPromiseError, match="of step 14 comes from a state of 6 steps before"):
        account.check()


def test_a_strategy_that_is_too_old_breaks_a_promise(account: Account) -> None:
    account.strategy_ages[10] = 9
    with pytest.raises(BrokenPromiseError, match="of step 12 comes from a strategy 11 steps old"):
        account.check()


def test_an_input_that_nobody_planned_or_can_do_breaks_a_promise(account: Account) -> None:
    del account.seen[1]  # what is not known is not judged
    account.check()
    account.seen[2] = account.seen[2]._replace(omega=0.5)
    with pytest.raises(BrokenPromiseError, match="of step 12 comes from no plan"):
        account.check()
    account.lost = 1  # it may be of that one
    assert account.check()["unknown_inputs"] == 1
    account.seen[2] = account.seen[2]._replace(omega=2.5)
    with pytest.raises(BrokenPromiseError, match="of step 12 is beyond its limits"):
        account.check()


def test_a_robot_that_stands_too_late_breaks_a_promise(account: Account) -> None:
    with pytest.raises(BrokenPromiseError, match="stands after 9 steps, and not 8"):
        account.stood_after(0.05, 2.0, 8)
    account.commands = [(1.0, 0.5), (1.4, 0.5), (1.8, 0.0), (3.1, 0.5)]
    assert account.base_stood_after(0.0, 3.0) == {"base_stood_s": 1.4}
    with pytest.raises(BrokenPromiseError, match=r"a base is told to move for 3\.1 s"):
        account.base_stood_after(0.0, 4.0)
