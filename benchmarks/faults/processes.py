"""Nodes that are killed or stopped, and runs that are interrupted."""

from __future__ import annotations

import os
import random
import signal
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from account import promise
from faulty_run import NODES
from run_command import DEADLINE
from trial import (
    LEAST,
    STANDS_AFTER,
    STANDS_WITHOUT_STRATEGIES_AFTER,
    Fault,
    Figures,
    RunTrial,
    a_run,
)

#: A run that ends by itself is over by then, in s.
_WHOLE_RUN = 15.0

#: Steps after its start until an inference publishes what it has made of all states so far: 3 s
#: for the discovery of others and the lease of the one before it, and eight steps.
_REBUILT_AFTER = 38

#: Index of the human whose node is in `NODES`.
_HUMAN = 1

#: Within how many steps the robot stands that lacks a node; it needs no others.
_STANDS = {"robot_planner": STANDS_AFTER, "inference": STANDS_WITHOUT_STRATEGIES_AFTER}


def is_started_anew(node: str, folder: Path) -> Figures:
    """The run continues with the restarted node."""
    scenario = "three_player" if node == "inference" else ""
    with a_run(folder, "--respawn", scenario=scenario) as trial:
        beliefs = trial.witness.hear_beliefs() if node == "inference" else []
        plans = trial.witness.hear_plans(_HUMAN)
        run, begin = trial.run, time.monotonic()
        run.kill(node)
        run.until(lambda: run.log(node).count("ready: ") == 2)
        ready = time.monotonic()
        newest = trial.account.seen[-1].step if node != "simulator" else 0
        trial.figures["ready_s"] = ready - begin
        if node in _STANDS:
            trial.figures |= trial.account.stood_after(begin, ready, _STANDS[node])
        if node == "simulator":
            run.until(lambda: "The run restarts" in run.stdout)
            trial.figures |= trial.account.base_stood_after(begin, ready)
        run.until_goes_on()
        if node == "inference":
            run.until(lambda: beliefs and beliefs[-1] > ready)
            steps = (next(t for t in beliefs if t > ready) - ready) / 0.1
            trial.figures["rebuild_steps"] = steps
            promise(steps <= _REBUILT_AFTER, f"the belief is there after {steps:.0f} steps")
            # These players soon arrive, so that the robot need not move.
            run.until(lambda: trial.account.follows(newest))
        else:
            trial.until_resumes(ready)
        run.until(lambda: plans and plans[-1] > newest)
        told = [line for line in run.stderr.splitlines() if "2 publishers" not in line]
        promise(not told, f"it complains: {told}")
    return trial.figures


def is_stopped(node: str, folder: Path) -> Figures:
    """The run resumes by itself when the node does."""
    with a_run(folder) as trial:
        run, seconds = trial.run, random.uniform(0.2, 3.0)
        plans = trial.witness.hear_plans(_HUMAN)
        pid, begin = run.pid(node), time.monotonic()
        os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        again, newest = time.monotonic(), trial.account.seen[-1].step
        os.kill(pid, signal.SIGCONT)
        if node in _STANDS:
            trial.figures |= trial.account.stood_after(begin, again, _STANDS[node])
        if node == "simulator":
            trial.figures |= trial.account.base_stood_after(begin, again)
        trial.until_resumes(again)
        run.until(lambda: plans and plans[-1] > newest)
        run.until_goes_on()
        promise(run.stderr == "", f"it complains: {run.stderr}")
    return trial.figures


def is_told_to_end(folder: Path) -> Figures:
    """The run ends, whether it is starting, playing, writing results, or already over.

    It is told once, or twice at once, as when a terminal is closed and its session is ended.
    """
    with ExitStack() as endings:
        start, moment = time.monotonic(), random.uniform(0.0, _WHOLE_RUN)
        signals = random.sample(
            (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), random.choice((1, 2))
        )
        trial = RunTrial(folder, steps=30)
        endings.callback(trial.run.end)
        endings.callback(trial.stops_watching)
        run = trial.run
        while time.monotonic() < start + moment:
            run.nodes()
            time.sleep(0.05)
        begin, said = time.monotonic(), run.stdout.splitlines()[-1:]
        for number in signals:
            run.process.send_signal(number)
            time.sleep(random.uniform(0.0, 0.002))
        names = " and ".join(number.name for number in signals)
        # It may have been about to start nodes.
        while run.process.poll() is None:
            promise(time.monotonic() < begin + DEADLINE, f"it goes on after {names}")
            run.nodes()
            time.sleep(0.05)
        code, when = run.exit_code(), f"by {names} at {moment:.1f} s, after {said}"
        # While Python itself starts, it ends in a way of its own.
        promise(code in (0, 130) or moment < 1.0, f"the exit code is {code} {when}")
        promise(run.stderr == "" or moment < 1.0, f"it complains {when}: {run.stderr}")
        trial.judge(LEAST if run.step >= 20 else 0)
        trial.nothing_is_left()
        return {**trial.figures, "all_gone_s": time.monotonic() - begin}


FAULTS: dict[str, Fault] = {
    **{
        f"{what}: {node}": partial(do, node)
        for what, do in (
            ("kill -9 with --respawn", is_started_anew),
            ("SIGSTOP for 0.2 to 3 s", is_stopped),
        )
        for node in NODES
    },
    "signals to the orchestrator at any time from its start on": is_told_to_end,
}
