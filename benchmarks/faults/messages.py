"""Lost, late, duplicated and far too many messages, and nodes that start late."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from unittest import mock

from account import promise
from faulty_run import NODES
from faulty_stack import DELAY, DROP, DUPLICATE, PASS, RELAYED, REORDER
from trial import (
    STANDS_AFTER,
    STANDS_WITHOUT_STRATEGIES_AFTER,
    Fault,
    Figures,
    a_stack,
    until,
)

#: Steps after which the robot stands that hears nothing more on a topic.
_STANDS = {
    "joint_state": STANDS_AFTER,
    "robot_strategy": STANDS_WITHOUT_STRATEGIES_AFTER,
    "robot/control": STANDS_AFTER,
}

#: Messages a second of a stranger, and for how long, in s.
RATE, FLOOD = 5000, 10.0

#: Steps until everybody has discovered a stranger.
DISCOVERY = 30


def are_lost(topic: str, folder: Path) -> Figures:
    """The robot stops in time, and resumes when messages arrive again."""
    with a_stack(folder) as trial:
        stack = trial.stack
        stack.for_steps(random.randrange(20))
        stack.relay.modes[topic] = DROP
        begin = time.monotonic()
        stack.for_steps(_STANDS[topic] + 10)
        again = time.monotonic()
        stood = trial.account.stood_after(begin, again, _STANDS[topic])
        promise(stood, "too few steps were received")
        trial.figures |= stood
        stack.relay.modes[topic] = PASS
        trial.until_resumes(again)
    return trial.figures


def are_spoilt(mode: str, folder: Path) -> Figures:
    """The robot continues, and does not slow down if messages are only duplicated."""
    with a_stack(folder) as trial:
        stack, begin = trial.stack, time.monotonic()
        stack.relay.modes = dict.fromkeys(RELAYED, mode)
        stack.for_steps(50)
        again = time.monotonic()
        slowest = trial.figures["slowest_m_s"] = float(trial.account.speeds(begin, again).min())
        promise(mode != DUPLICATE or slowest > 0.1, "the robot slowed down")
        stack.relay.modes = dict.fromkeys(RELAYED, PASS)
        trial.until_resumes(again)
        stack.until(lambda: not stack.robot_is_late)
    return trial.figures


def are_of_a_stranger(topic: str, stands_after: int, folder: Path) -> Figures:
    """The robot stops if a topic that it follows has two publishers; otherwise it continues."""
    bound = DISCOVERY + stands_after
    with a_stack(folder, relayed=()) as trial:
        with mock.patch.dict(os.environ, ROS_DOMAIN_ID=str(trial.domain)):
            command = [sys.executable, str(Path(__file__).with_name("stranger.py"))]
            stranger = subprocess.Popen(
                [*command, topic, str(RATE)], stdout=subprocess.PIPE, text=True
            )
        try:
            assert stranger.stdout is not None
            promise(stranger.stdout.readline() == "begins\n", "the stranger hears nothing")
            begin = time.monotonic()
            time.sleep(FLOOD)
            heard = trial.account.speeds
            until(lambda: len(heard(begin, time.monotonic())) > bound + 10, "steps are heard of")
            again = time.monotonic()
            stranger.send_signal(signal.SIGINT)
            sent = stranger.communicate(timeout=60.0)[0]
        finally:
            stranger.kill()
            stranger.wait()
        trial.figures["messages_per_s"] = float(sent) / (again - begin)
        if stands_after:
            stood = trial.account.stood_after(begin, again, bound)
            promise(stood, "too few steps were received")
            trial.figures |= stood
        else:
            slowest = float(trial.account.speeds(begin, again).min())
            trial.figures["slowest_m_s"] = slowest
            promise(slowest > 0.1, "the robot slowed down")
        trial.until_resumes(again)
        # In a flood, who watches hears of plans much later than of what came of them.
        plans, seen = trial.account.plans, trial.account.seen
        until(lambda: plans[-1].step >= seen[-1].step, "all plans are heard of")
    return trial.figures


def is_late(gap: float, folder: Path) -> Figures:
    """The run starts when all nodes are present."""
    order = tuple(random.sample(NODES, len(NODES)))
    with a_stack(folder, order=order, gap=gap) as trial:
        promise(min(trial.stack.recorder.record.beliefs) == 0, "the first belief is missing")
    return trial.figures


def faults(gap: float) -> dict[str, Fault]:
    """Return all of these faults; nodes start at most `gap` seconds apart."""
    return {
        **{f"messages lost: {topic}": partial(are_lost, topic) for topic in RELAYED},
        **{f"messages: {mode}": partial(are_spoilt, mode) for mode in (DUPLICATE, REORDER, DELAY)},
        **{
            f"messages of a stranger, thousands a second: {topic}": partial(
                are_of_a_stranger, topic, stands_after
            )
            for topic, stands_after in {**_STANDS, "belief": 0, "map_equilibrium": 0}.items()
        },
        "nodes start in any order, at once": partial(is_late, 0.0),
        f"nodes start in any order, {gap:g} s apart": partial(is_late, gap),
    }
