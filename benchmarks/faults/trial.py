"""A run into which faults are injected, and the checks of every run."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from account import MOVES, STANDS, promise
from faulty_run import FaultyRun
from faulty_stack import FaultyStack
from passing import write_scenario
from rclpy.node import Node
from ros_domain import free_domain
from run_command import DEADLINE
from witness import Bystander, Witness

from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.scenario import Scenario, find

Figures = dict[str, float]

#: Smallest number of inputs and commands of a trial; with fewer, the checks prove nothing.
LEAST = 5

#: Number of steps to receive before a fault is injected.
_FIRST = 10

#: Number of steps until standstill without new states or control messages, and without new
#: strategies.
STANDS_AFTER, STANDS_WITHOUT_STRATEGIES_AFTER = 15, 20

#: Injects a fault, with a folder for files, and returns figures.
Fault = Callable[[Path], Figures]


def until(condition: Callable[[], object], what: str) -> None:
    """Wait until a condition holds, as guaranteed."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        promise(time.monotonic() < deadline, f"{what}: not within {DEADLINE:.0f} s")
        time.sleep(0.02)


class Trial:
    """A run of a scenario file in a ROS domain, and the account of its observed behaviour.

    Attributes:
        figures: the worst figure of each guarantee.
    """

    def __init__(self, scenario: Path, domain: int) -> None:
        self.domain, self.figures = domain, Figures()
        self._wait: Callable[[float], None] = time.sleep
        self._watch = Bystander(domain, lambda **o: Witness(Scenario.load(scenario), **o))
        self.witness: Witness = self._watch.node
        self.account = self.witness.account

    def is_heard(self) -> bool:
        """Return whether some steps have been received, and the robot moves and is commanded to."""
        seen, commands = self.account.seen, self.account.commands
        if min(len(seen), len(commands)) < _FIRST:
            return False
        return abs(seen[-1].speed) > MOVES and commands[-1][1] > STANDS

    def until_resumes(self, since: float) -> None:
        """Wait until the robot moves by data newer than a time; store how long it took.

        Rolling on, or following an old plan, does not count; see `Account.resumed`.
        """
        deadline = time.monotonic() + DEADLINE
        while (resumed := self.account.resumed(since)) is None:
            promise(
                time.monotonic() < deadline, f"the robot does not resume within {DEADLINE:.0f} s"
            )
            self._wait(0.2)
        self.figures["resume_s"] = max(self.figures.get("resume_s", 0.0), resumed - since)

    def stops_watching(self) -> None:
        """End the account, or raise the exception that ended the witness."""
        self._watch.end()

    def judge(self, least: int = LEAST) -> None:
        """Check all received inputs, and that there are at least `least`."""
        self.stops_watching()
        self.figures |= self.account.check(least)


class RunTrial(Trial):
    """A recorded run of `gameinfer run` with further arguments.

    Without a scenario, two players pass each other.

    Attributes:
        beside: a node that the run needs; None if it needs none.
    """

    def __init__(
        self, folder: Path, *arguments: object, steps: int = 10**6, scenario: str = ""
    ) -> None:
        file = find(scenario) if scenario else write_scenario(folder)
        super().__init__(file, domain := free_domain())
        self.bag = folder / "bag"
        options = ("--scenario", file, "--record", self.bag, "--steps", steps, *arguments)
        self.run = FaultyRun(folder / "run", *options, domain=domain)
        self.beside: Bystander | None = None

    def is_under_way(self) -> None:
        """Wait for some steps."""
        self.run.until_step(10)
        self.run.nodes()  # it remembers them
        time.sleep(random.uniform(0.0, 2.0))
        until(self.is_heard, "it is heard and moves")

    def nothing_is_left(self) -> None:
        """Check the guarantees about processes and the bag."""
        run = self.run
        run.until_gone()
        # One that was interrupted before it recorded anything has no bag.
        promise(run.step < 0 or self.bag.exists(), "there is no bag")
        if self.bag.exists():
            bag = RunBag(self.bag)
            promise(bag.finished, "the bag is not finished")
            record = bag.record()
            promise(record.steps >= run.step - 20, "the bag lacks more than two seconds")
            promise(record.steps or run.step < 0, "the bag has no step")
            for s, w in zip(record.states[1:], record.inputs, strict=True):
                there = np.isfinite(s).all()  # time may have jumped
                promise(np.isfinite(w).all() or not there, "an input is not finite")


@contextmanager
def a_run(
    folder: Path,
    *arguments: object,
    scenario: str = "",
    beside: Callable[..., Node] | None = None,
) -> Iterator[RunTrial]:
    """Start a run, with a node `beside` it. At the end, Ctrl-C ends it if it still runs."""
    with ExitStack() as endings:
        trial = RunTrial(folder, *arguments, scenario=scenario)
        endings.callback(trial.run.end)
        endings.callback(trial.stops_watching)
        if beside is not None:
            trial.beside = Bystander(trial.domain, beside)
            endings.callback(trial.beside.end)
        trial.is_under_way()
        yield trial
        if trial.run.process.poll() is None:
            trial.run.nodes()  # also those that were restarted
            promise(trial.run.ends_by(signal.SIGINT) == 130, "the exit code is not 130")
        trial.judge()
        trial.nothing_is_left()


class StackTrial(Trial):
    """Nodes without an orchestrator, with options of `FaultyStack`."""

    def __init__(self, folder: Path, **options: Any) -> None:
        super().__init__(write_scenario(folder), domain := free_domain())
        with mock.patch.dict(os.environ, ROS_DOMAIN_ID=str(domain)):
            self.stack = FaultyStack(folder / "stack", domain, **options)
        if options.get("relayed", True):
            self._wait = self.stack.spin  # it also passes messages on meanwhile


@contextmanager
def a_stack(folder: Path, **options: Any) -> Iterator[StackTrial]:
    """Start nodes, with a relay between them by default."""
    with ExitStack() as endings:
        trial = StackTrial(folder, **options)
        stack = trial.stack
        endings.callback(stack.end)
        endings.callback(trial.stops_watching)
        stack.until(lambda: stack.step >= 10 and stack.speeds[-1] > 0.1 and trial.is_heard())
        yield trial
        trial.judge()
        promise(np.isfinite(stack.inputs).all(), "an input is not finite")
    left = [node.name for node in stack.nodes if os.path.exists(f"/proc/{node.pid}")]
    promise(not left, f"processes are left: {left}")
