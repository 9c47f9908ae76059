"""A campaign of faults against the running stack: what happens, and whether promises hold.

    ./dev exec python benchmarks/faults.py [--repetitions N] [--seed N] [--gap S] [--json FILE]

Nodes and orchestrators are killed, stopped and interrupted at random steps, messages are lost,
delayed, doubled and reordered, and nodes started in random order, up to `--gap` seconds apart.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

# The top folder too, because the tests have folders with the names of packages.
sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("", "test")]

from faulty_run import NODES, FaultyRun, abandoned
from faulty_stack import DELAY, DROP, DUPLICATE, PASS, RELAYED, REORDER, FaultyStack
from ros_domain import free_domain

from gameinfer_ros import shared_memory
from gameinfer_ros.experiments import machine
from gameinfer_ros.inference import Belief
from gameinfer_ros.run_bag import RunBag
from gameinfer_ros.solver import IterativeLQ

#: Steps after which the robot stands that hears nothing more on a topic.
STANDS_AFTER = {"joint_state": 15, "map_strategy": 20, "robot/control": 15}

Figures = dict[str, float]


class BrokenPromiseError(AssertionError):
    """What was promised is not what happened."""


def promise(holds: object, what: str) -> None:
    """Raise an exception if a promise does not hold."""
    if not holds:
        raise BrokenPromiseError(what)


@contextmanager
def a_run(folder: Path, *arguments: object, steps: int = 10**6) -> Iterator[FaultyRun]:
    """A run that is recorded, in which some steps have been made."""
    bag = folder / "bag"
    run = FaultyRun(folder / "run", "--record", bag, "--steps", steps, *arguments)
    try:
        run.until_step(10)
        time.sleep(random.uniform(0.0, 2.0))
        yield run
    finally:
        run.end()


def nothing_is_left(run: FaultyRun, held: set[str]) -> None:
    """Check that processes, shared memory and bag are as promised."""
    run.until_gone()
    shared_memory.remove_abandoned()  # as the next run does
    left = abandoned(held)
    promise(not left, f"shared memory is left: {left}")
    record = RunBag(run.out.parents[1] / "bag").record()
    promise(record.steps >= run.step - 20, "the bag lacks more than two seconds")
    promise(np.isfinite(np.array(record.inputs)).all(), "an input is not finite")


def node_is_killed(node: str, folder: Path) -> Figures:
    """The run ends with exit code 1 and says why."""
    with a_run(folder) as run:
        held = run.shared_memory()
        begin = time.monotonic()
        os.kill(run.pid(node), signal.SIGKILL)
        promise(run.exit_code() == 1, "the exit code is another one")
        promise(f"{node} ended with signal SIGKILL" in run.stderr, "it does not say why")
        left = abandoned(held)
        promise(not left, f"shared memory is left by the orchestrator: {left}")
        nothing_is_left(run, held)
        return {"run_ended_s": time.monotonic() - begin}


def node_is_killed_and_started_anew(node: str, folder: Path) -> Figures:
    """The run goes on, and the new node is as good as the old one."""
    scenario = ("--scenario", "three_player") if node == "inference" else ()
    with a_run(folder, "--respawn", *scenario) as run:
        begin, step = time.monotonic(), run.step
        run.kill(node)
        run.until(lambda: run.log(node).count("ready: ") == 2)
        figures = {"ready_s": time.monotonic() - begin}
        if node == "simulator":
            run.until(lambda: "begins anew" in run.stdout)
        run.until_goes_on()
        figures["goes_on_s"] = time.monotonic() - begin
        if node == "inference":
            run.until(lambda: "has caught up" in run.log(node))
            ready, caught_up = (
                float(re.findall(rf"\[([\d.]+)\].*{words}", run.log(node))[-1])
                for words in ("ready: ", "has caught up")
            )
            figures["caught_up_steps"] = (caught_up - ready) / 0.1
        promise(run.ends_by(signal.SIGINT) == 130, "the exit code is another one")
        promise(run.stderr == "", "it complains")
        if node == "inference":
            figures |= worth_of_belief(folder / "bag", run.out, step)
        return figures


def worth_of_belief(bag: Path, out: Path, killed: int) -> Figures:
    """How far the rebuilt belief is from the one of an undisturbed update at each step."""
    recorded = RunBag(bag)
    scenario, record = recorded.scenario, recorded.record()
    parameters = json.loads((out / "parameters/inference.yaml").read_text())["/**"]
    seed = parameters["ros__parameters"]["seed"]
    solver, vehicles = IterativeLQ(scenario.game, scenario.solver), scenario.vehicles
    belief = Belief(solver, scenario.seeds, scenario.inference, np.random.default_rng(seed))
    own = scenario.game.players.inputs(0)
    gap = sorted(set(range(killed, len(record.states))) - set(record.beliefs))
    rebuilt = next(step for step in sorted(record.beliefs) if step > gap[0])
    before = vehicles.game_state(record.states[0])
    belief.solve(0, before)
    for step in range(1, rebuilt + 1):
        s, w = record.states[step - 1], record.inputs[step - 1]
        x = vehicles.game_state(record.states[step])
        belief.weigh(step - 1, before, x, vehicles.game_input(s, w)[own])
        belief.combine_duplicates()
        belief.solve(step, x)
        before = x
    usual = dict(zip(belief.ids.tolist(), belief.weights.tolist(), strict=True))
    found = record.beliefs[rebuilt]
    far = sum(abs(usual.get(i, 0.0) - found.get(i, 0.0)) for i in {*usual, *found}) / 2
    assert belief.map is not None
    return {
        "without_belief_steps": float(rebuilt - gap[0]),
        "total_variation": far,
        "same_map": float(record.maps[rebuilt] == belief.ids[belief.map]),
    }


def node_is_stopped(node: str, folder: Path) -> Figures:
    """The run goes on by itself once the node does."""
    with a_run(folder) as run:
        seconds = random.uniform(0.2, 3.0)
        pid = run.pid(node)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(pid, signal.SIGCONT)
        begin = time.monotonic()
        run.until_goes_on()
        goes_on = time.monotonic() - begin
        held = run.shared_memory()
        promise(run.ends_by(signal.SIGINT) == 130, "the exit code is another one")
        promise(run.stderr == "", "it complains")
        nothing_is_left(run, held)
        return {"20_steps_after_s": goes_on}


def orchestrator_gets(signal_name: str, folder: Path) -> Figures:
    """All nodes end, and nothing is left."""
    number = signal.Signals[signal_name]
    with a_run(folder) as run:
        held = run.shared_memory()
        begin = time.monotonic()
        expected = -9 if number == signal.SIGKILL else 130
        promise(run.ends_by(number) == expected, "the exit code is another one")
        run.until_gone()
        gone = time.monotonic() - begin
        nothing_is_left(run, held)
        return {"all_gone_s": gone}


@contextmanager
def a_stack(folder: Path, **options: Any) -> Iterator[FaultyStack]:
    """Nodes with a relay between them, under way."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(domain := free_domain())
    stack = FaultyStack(folder, domain, **options)
    try:
        stack.until(lambda: stack.step >= 10 and stack.speeds[-1] > 0.1)
        yield stack
        promise(np.isfinite(stack.inputs).all(), "an input is not finite")
    finally:
        stack.end()


def messages_are_lost(topic: str, folder: Path) -> Figures:
    """The robot stands in time, and goes on when it hears again."""
    with a_stack(folder) as stack:
        stack.for_steps(random.randrange(20))
        stack.relay.modes[topic] = DROP
        begin = stack.step
        stack.for_steps(STANDS_AFTER[topic] + 10)
        moving = np.flatnonzero(stack.speeds[begin:] > 0.01)
        promise(moving[-1] < STANDS_AFTER[topic], "the robot does not stand in time")
        stack.relay.modes[topic] = PASS
        again = stack.step
        stack.until(lambda: stack.speeds[-1] > 0.05)
        return {"stood_after_steps": moving[-1] + 1.0, "went_on_steps": float(stack.step - again)}


def messages_are_spoilt(mode: str, folder: Path) -> Figures:
    """The robot goes on, and does not slow down if messages are only doubled."""
    with a_stack(folder) as stack:
        begin = stack.step
        stack.relay.modes = dict.fromkeys(RELAYED, mode)
        stack.for_steps(50)
        slowest = float(stack.speeds[begin:].min())
        promise(mode != DUPLICATE or slowest > 0.1, "the robot slowed down")
        stack.relay.modes = dict.fromkeys(RELAYED, PASS)
        stack.until(lambda: not stack.robot_is_late and stack.speeds[-1] > 0.1)
        return {"slowest_m_s": slowest}


def nodes_start_in_any_order(gap: float, folder: Path) -> Figures:
    """The run begins when all are there."""
    order = tuple(random.sample(NODES, len(NODES)))
    with a_stack(folder, order=order, gap=random.uniform(0.0, gap)) as stack:
        promise(min(stack.recorder.record.beliefs) == 0, "the first belief is missing")
    return {}


def faults(gap: float) -> dict[str, Callable[[Path], Figures]]:
    """All faults by their names."""
    found: dict[str, Callable[[Path], Figures]] = {}
    for node in NODES:
        found[f"kill -9 of {node}"] = lambda f, n=node: node_is_killed(n, f)
        found[f"the same with --respawn: {node}"] = lambda f, n=node: (
            node_is_killed_and_started_anew(n, f)
        )
        found[f"SIGSTOP of {node} for 0.2 to 3 s"] = lambda f, n=node: node_is_stopped(n, f)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL"):
        found[f"{name} of the orchestrator"] = lambda f, n=name: orchestrator_gets(n, f)
    for topic in RELAYED:
        found[f"all messages on {topic} lost"] = lambda f, t=topic: messages_are_lost(t, f)
    for mode in (DUPLICATE, REORDER, DELAY):
        found[f"messages: {mode}"] = lambda f, m=mode: messages_are_spoilt(m, f)
    found["nodes started in any order"] = lambda f: nodes_start_in_any_order(gap, f)
    return found


def campaign(options: argparse.Namespace, console: Console) -> dict[str, Any]:
    """Try all faults; tells what was promised, what held, and the figures of each."""
    random.seed(options.seed)
    told = {}
    for name, fault in faults(options.gap).items():
        if options.only not in name:
            continue
        held, broken, figures = 0, [], []
        for _ in range(options.repetitions):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    figures.append(fault(Path(folder)))
                    held += 1
                except AssertionError as error:  # of a promise, or a deadline
                    broken.append(str(error))
        told[name] = {
            "times": options.repetitions,
            "held": held,
            "broken": broken,
            "worst": {
                key: (min if key in ("same_map", "slowest_m_s") else max)(f[key] for f in figures)
                for key in (figures[0] if figures else {})
            },
        }
        console.print(f"{name}: {held} of {options.repetitions}")
    return told


def show(told: dict[str, Any], console: Console) -> None:
    """Print all figures as one table."""
    table = Table("fault", "held", "worst figures", "broken")
    for name, row in told.items():
        worst = ", ".join(f"{key} {value:.3g}" for key, value in row["worst"].items())
        table.add_row(name, f"{row['held']} of {row['times']}", worst, "; ".join(row["broken"]))
    console.print(table)


def main() -> None:
    """Run the campaign and print what it shows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=3, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    parser.add_argument(
        "--gap", type=float, default=5.0, metavar="S",
        help="longest time between the starts of two nodes, in s",
    )  # fmt: skip
    parser.add_argument("--only", default="", metavar="WORDS", help="faults with these words")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures here too")
    options = parser.parse_args()
    if options.repetitions < 1:
        parser.error(f"--repetitions: {options.repetitions} is not at least 1")
    console = Console(soft_wrap=True)
    told = campaign(options, console)
    show(told, console)
    if options.json:
        figures = {"machine": machine.describe(), "seed": options.seed, "faults": told}
        options.json.write_text(json.dumps(figures, indent=2) + "\n")
    if any(row["broken"] for row in told.values()):
        sys.exit(1)


if __name__ == "__main__":
    main()
