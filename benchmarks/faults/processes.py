"""Nodes that are killed or stopped."""

from __future__ import annotations

import os
import random
import signal
import time
from functools import partial
from pathlib import Path

from faulty_run import NODES, abandoned
from promise import (
    REBUILT_AFTER,
    STANDS_AFTER,
    STANDS_WITHOUT_STRATEGIES_AFTER,
    promise,
)
from rebuilt_belief import worth
from trial import Fault, Figures, a_run

#: Index of the human whose node is in `NODES`.
_HUMAN = 1

#: Within how many steps the robot stands that lacks a node; it needs no others.
_STANDS = {"robot_planner": STANDS_AFTER, "inference": STANDS_WITHOUT_STRATEGIES_AFTER}


def is_killed(node: str, folder: Path) -> Figures:
    """The run ends with exit code 1 and says why."""
    with a_run(folder) as trial:
        run, begin = trial.run, time.monotonic()
        os.kill(run.pid(node), signal.SIGKILL)
        promise(run.exit_code() == 1, "the exit code is another one")
        promise(f"{node} ended with signal SIGKILL" in run.stderr, "it does not say why")
        trial.stops_watching()
        left = abandoned(trial.held)
        promise(not left, f"shared memory is left by the orchestrator: {left}")
        trial.figures["run_ended_s"] = time.monotonic() - begin
    return trial.figures


def is_started_anew(node: str, folder: Path) -> Figures:
    """The run goes on, and the new node is as good as the old one."""
    scenario = "three_player" if node == "inference" else ""
    with a_run(folder, "--respawn", scenario=scenario) as trial:
        beliefs = trial.witness.hear_beliefs() if node == "inference" else []
        plans = trial.witness.hear_plans(_HUMAN)
        run, begin, step = trial.run, time.monotonic(), trial.run.step
        run.kill(node)
        run.until(lambda: run.log(node).count("ready: ") == 2)
        ready = time.monotonic()
        newest = trial.account.seen[-1].step if node != "simulator" else 0
        trial.figures["ready_s"] = ready - begin
        if node in _STANDS:
            trial.figures |= trial.account.stood_after(begin, ready, _STANDS[node])
        if node == "simulator":
            run.until(lambda: "begins anew" in run.stdout)
            trial.figures |= trial.account.base_stood_after(begin, ready)
        run.until_goes_on()
        if node == "inference":
            run.until(lambda: beliefs and beliefs[-1] > ready)
            steps = (next(t for t in beliefs if t > ready) - ready) / 0.1
            trial.figures["rebuild_steps"] = steps
            promise(steps <= REBUILT_AFTER, f"the belief is there after {steps:.0f} steps")
            # These players soon arrive, so that the robot need not move.
            run.until(lambda: trial.account.follows(newest))
        else:
            trial.until_resumes(ready)
        run.until(lambda: plans and plans[-1] > newest)
        told = [line for line in run.stderr.splitlines() if "2 publishers" not in line]
        promise(not told, f"it complains: {told}")
    if node == "inference":
        trial.figures |= worth(trial.bag, run.out, step)
    return trial.figures


def is_stopped(node: str, folder: Path) -> Figures:
    """The run goes on by itself once the node does."""
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


FAULTS: dict[str, Fault] = {
    f"{what}: {node}": partial(do, node)
    for what, do in (
        ("kill -9", is_killed),
        ("kill -9 with --respawn", is_started_anew),
        ("SIGSTOP for 0.2 to 3 s", is_stopped),
    )
    for node in NODES
}
