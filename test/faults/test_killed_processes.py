"""Processes that are killed or stopped: nothing is left of a run, and its data can be read."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from faulty_run import NODES, FaultyRun
from ros_domain import free_domain

from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.names.defaults import RESPAWN_LIMIT

Start = Callable[..., FaultyRun]
Inspect = Callable[[Path], dict[str, Any]]


def test_nothing_is_left_of_an_orchestrator_that_was_killed(
    start: Start, inspect: Inspect, tmp_path: Path
) -> None:
    bag, domain = tmp_path / "bag", free_domain()
    run = start("--record", bag, domain=domain)
    run.until_step(20)
    assert run.shared_memory() == set()  # which it would leave behind
    # A process that is stopped cannot see that anything has happened.
    os.kill(run.pid("simulator"), signal.SIGSTOP)
    run.process.kill()
    run.process.wait()
    run.until_gone()

    found = inspect(bag)
    assert not found["finished"]
    # Up to two seconds may be missing: one until all is flushed, and one until it is told.
    assert found["steps"] >= 10
    replay = [sys.executable, "-m", "gameinfer_ros", "replay", str(bag)]
    there = {**os.environ, "ROS_DOMAIN_ID": str(domain)}  # no dead process is in its way
    done = subprocess.run(replay, capture_output=True, text=True, timeout=120, env=there)
    assert "Steps with a belief in the bag" in done.stdout, done.stderr
    after = start("--time", "lockstep", steps=5, domain=domain)
    assert after.exit_code() == 0, after.stdout + after.stderr


def test_a_run_continues_when_its_nodes_are_killed_one_after_the_other(
    start: Start, inspect: Inspect, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    run = start("--respawn", "--record", bag)
    run.until_step(20)
    for node in ("inference", "robot_planner", "human_1_agent"):
        run.kill(node)
        run.until(lambda node=node: run.log(node).count("ready: ") == 2)
        run.until_goes_on()
    assert "has caught up with step" in run.log("inference")
    assert "The run restarts" not in run.stdout

    before = run.step
    run.kill("simulator")
    run.until(lambda: "The run restarts." in run.stdout)
    run.until_step(20)
    assert run.ends_by(signal.SIGINT) == 130, run.stderr
    # For three seconds, a dead simulator and the new one count as two, and neither is believed.
    told = run.stderr.splitlines()
    rejected = re.compile("message on (joint_state|run_start|belief) rejected: 2 publishers")
    assert all(rejected.search(line) for line in told), told
    assert inspect(bag)["finished"]
    # What the last beginning has swept away is in the bag, too.
    assert sum(1 for _ in RunBag(bag)._messages("joint_state")) > before + 20


def test_in_lockstep_a_run_continues_as_if_no_node_had_been_killed(start: Start) -> None:
    lockstep = ("--time", "lockstep", "--json")
    usual, run = start(*lockstep, steps=100), start(*lockstep, "--respawn", steps=100)
    run.until_step(30)
    run.kill("inference")
    for command in (usual, run):
        assert command.exit_code() == 0, command.stdout + command.stderr
    assert run.summary == usual.summary


def test_a_node_that_dies_again_and_again_ends_the_run(start: Start) -> None:
    run = start("--respawn")
    run.until(lambda: len(run.nodes()) == len(NODES))
    for _ in range(RESPAWN_LIMIT):
        run.kill("robot_planner")
    os.kill(run.pid("robot_planner"), signal.SIGKILL)
    assert run.exit_code() == 1, run.stdout + run.stderr
    assert "the node robot_planner ended with signal SIGKILL" in run.stderr
    assert run.leftovers() == {}


def test_a_run_whose_inference_hangs_comes_to_its_end_all_the_same(start: Start) -> None:
    run = start("--json", steps=30)
    run.until_step(10)
    inference = run.pid("inference")
    os.kill(inference, signal.SIGSTOP)
    run.until(lambda: "The inference does not respond: the last belief is of step" in run.stderr)
    os.kill(inference, signal.SIGCONT)
    assert run.exit_code() == 0, run.stdout + run.stderr
    assert run.summary["steps"] == 30
    assert (run.out / "run.json").exists()


def test_a_run_continues_when_each_of_its_nodes_was_stopped_for_a_while(start: Start) -> None:
    run = start()
    run.until_step(20)
    for node in NODES:
        os.kill(run.pid(node), signal.SIGSTOP)
        time.sleep(1.0)
        os.kill(run.pid(node), signal.SIGCONT)
        run.until_goes_on()
    assert "robot resumes at step" in run.log("robot_planner")
    assert run.ends_by(signal.SIGINT) == 130, run.stderr
    assert run.stderr == ""
