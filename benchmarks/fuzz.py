"""Feed random bad input to everything that reads input.

    ./dev exec python benchmarks/fuzz.py [--seed N] [--minutes M | --cases N] [--json FILE]
        [--kinds KIND ...]

The kinds of input are scenario files, messages on all topics of all nodes, parameters, services and
bags, as in the tests in `test/fuzz`, but random and for longer. Prints for each kind how many cases
were tried, rejected with a reason, or accepted, how many crashed or hung, the slowest case, and the
growth of the memory after a warm-up. The exit code is 1 if a case crashed or hung.
"""

from __future__ import annotations

import argparse
import faulthandler
import itertools
import json
import os
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from rcl_interfaces.srv import SetParameters
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.table import Table
from std_srvs.srv import SetBool, Trigger

# The top folder comes first, because the tests have folders with the names of packages.
sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("", "test/support")]

import bad_bags
import bad_parameters
import bad_scenarios
from bad_messages import garbled, mutated
from nodes_room import LISTENERS, Run, memory, topics
from ros_domain import free_domain
from world import World

from msg_adapters import stamp

#: Time in s after which a case counts as hung.
HANGS = 60.0

#: A case: tries an input, and returns the outcome.
Case = Callable[[], str]


@dataclass
class Tally:
    """The outcomes of the cases of one kind."""

    outcomes: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0  # longest time of a case, in s
    complaints: list[str] = field(default_factory=list)  # tracebacks of the cases that crashed
    memory: list[int] = field(default_factory=list)  # after each case, in bytes

    def add(self, case: Case) -> None:
        """Try a case, and count its outcome."""
        start = time.monotonic()
        try:
            outcome = case()
        except Exception as error:
            outcome = "crashed"
            self.complaints.append("".join(traceback.format_exception(error)[-4:]))
        seconds = time.monotonic() - start
        self.slowest = max(self.slowest, seconds)
        self.outcomes.update([outcome] if seconds <= HANGS else [outcome, "hung"])
        self.memory.append(memory())

    def summary(self) -> dict[str, Any]:
        """Return the figures, as a JSON object."""
        warm = np.array(self.memory[len(self.memory) // 3 :]) / 2**20
        slope = np.polyfit(np.arange(len(warm)), warm, 1)[0] if len(warm) > 2 else 0.0
        return {
            "tried": len(self.memory),
            **{name: self.outcomes[name] for name in ("rejected", "accepted", "crashed", "hung")},
            "slowest_s": self.slowest,
            "memory_mb": float(warm[-1]) if len(warm) else None,
            "memory_mb_per_1000": 1000 * float(slope),
        }


def new_world() -> Any:
    """Create a world of nodes in a free ROS domain."""
    context = rclpy.Context()
    rclpy.init(
        context=context, domain_id=free_domain(), signal_handler_options=SignalHandlerOptions.NO
    )
    return World(context)


def small_scenario(folder: Path, steps: int) -> Path:
    """Write a scenario with two unicycles side by side."""
    path = folder / f"pair_{steps}.yaml"
    path.write_bytes(bad_scenarios.text(bad_scenarios.pair(steps)))
    return path


def scenario_cases(rng: np.random.Generator, folder: Path) -> Iterator[Case]:
    """Yield cases that read a scenario file with a mistake."""
    good, path = bad_scenarios.bases(), folder / "some.yaml"
    for content in good:  # compile now, so that the times of cases do not include it
        path.write_bytes(bad_scenarios.text(content))
        assert bad_scenarios.outcome(path) == "accepted"

    def case() -> str:
        path.write_bytes(bad_scenarios.some(rng, good))
        return bad_scenarios.outcome(path)

    yield from itertools.repeat(case)


def message_cases(rng: np.random.Generator, folder: Path) -> Iterator[Case]:
    """Yield cases that send a mutated message of a real run on a topic of a node."""
    run = Run(new_world(), small_scenario(folder, 10), 10, listeners=1)
    run.listen()
    run.world.until(lambda: run.done)
    played = {topic: [*messages] for topic, messages in run.heard.items()}
    start = stamp.encode(run.simulator.clock.start)
    run.world.end()
    world, targets = new_world(), []
    for who, (make, parameters) in LISTENERS.items():
        name = who.replace(" ", "_")
        node = world.add(
            make, name, f"/{name}", scenario=small_scenario(folder, 10_000), **parameters
        )
        for topic, kind, profile in topics(node):
            relative = "/" + topic.removeprefix(f"/{name}/").lstrip("/")
            profile.depth = 1  # messages kept for late subscribers would count as growth
            publisher = world.publisher(kind, topic, profile)
            targets.append((node, kind, played.get(relative, []), publisher))
            if kind is Time:  # what was played is of this run
                world.send(publisher, start)

    def case() -> str:
        node, kind, models, publisher = targets[int(rng.integers(len(targets)))]
        model = kind()
        if models:
            model = rclpy.serialization.deserialize_message(
                models[int(rng.integers(len(models)))], kind
            )
        before = node.topic_faults.rejected.total()
        data = (garbled if rng.random() < 0.1 else mutated)(model, rng)
        if kind is Time:  # Fast DDS sends no more bytes than a time has; then the run continues
            publisher.publish(data[:12])
            data = rclpy.serialization.serialize_message(start)
        publisher.publish(data)
        end = time.monotonic() + 0.02  # a message that is not rejected by then counts as accepted
        while node.topic_faults.rejected.total() == before and time.monotonic() < end:
            world._executor.spin_once(timeout_sec=0.005)
        return "rejected" if node.topic_faults.rejected.total() > before else "accepted"

    try:
        yield from itertools.repeat(case)
    finally:
        world.end()


def parameter_cases(rng: np.random.Generator, folder: Path) -> Iterator[Case]:
    """Yield cases that set a parameter of a running node by its service."""
    world, targets = new_world(), []
    for who, (make, parameters) in LISTENERS.items():
        name = who.replace(" ", "_")
        node = world.add(make, name, scenario=small_scenario(folder, 10), **parameters)
        client = world.tester.create_client(SetParameters, f"/{name}/set_parameters")
        world.until(client.service_is_ready)
        targets.append((node, client))

    def case() -> str:
        node, client = targets[int(rng.integers(len(targets)))]
        before, request = bad_parameters.values(node), bad_parameters.some(node, rng)
        future = client.call_async(SetParameters.Request(parameters=[request]))
        world.until(future.done)
        return bad_parameters.check(node, request, before, future.result().results[0])

    try:
        yield from itertools.repeat(case)
    finally:
        world.end()


def service_cases(rng: np.random.Generator, folder: Path) -> Iterator[Case]:
    """Yield cases that pause, resume or reset a run in realtime."""
    file = small_scenario(folder, 30)
    run = Run(new_world(), file, 30, time="realtime")
    world = run.world
    others = (run.recorder, run.planner)
    resets = [f"{n.get_fully_qualified_name()}/reset" for n in run.nodes if n not in others]
    clients = [world.tester.create_client(Trigger, name) for name in resets]
    pause = world.tester.create_client(SetBool, "/simulator/pause")
    world.until(lambda: all(c.service_is_ready() for c in (*clients, pause)))

    def case() -> str:
        if rng.random() < 0.5:
            future = pause.call_async(SetBool.Request(data=bool(rng.integers(2))))
        else:
            future = clients[int(rng.integers(len(clients)))].call_async(Trigger.Request())
        world.until(future.done)
        if rng.random() < 0.02:  # occasionally check that the run can still be played
            resumed = pause.call_async(SetBool.Request(data=False))
            restarted = clients[-1].call_async(Trigger.Request())
            world.until(lambda: resumed.done() and restarted.done())
            world.until(lambda: run.simulator.world.step > 3)
        return "accepted" if future.result().success else "rejected"

    try:
        yield from itertools.repeat(case)
    finally:
        world.end()


def bag_cases(rng: np.random.Generator, folder: Path) -> Iterator[Case]:
    """Yield cases that read a bag with a damaged file, of a whole or an aborted recording."""
    file, copy = small_scenario(folder, 10), folder / "copy"
    run = Run(new_world(), file, 10, listeners=1)
    run.listen()
    run.world.until(
        lambda: run.done and all(len(run.heard[t]) > 10 for t in ("/joint_state", "/belief"))
    )
    kinds = {
        "/run_start": "builtin_interfaces/msg/Time",
        "/joint_state": "sensor_msgs/msg/MultiDOFJointState",
        "/belief": "std_msgs/msg/Float64MultiArray",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    messages = {topic: (kind, run.heard[topic]) for topic, kind in kinds.items()}
    bags = [folder / f"bag_{k}" for k in range(len(bad_bags.STATES))]
    for bag, state in zip(bags, bad_bags.STATES, strict=True):
        bad_bags.write(bag, file, messages, state)
        assert bad_bags.outcome(bag) == "accepted"
    run.world.end()

    def case() -> str:
        shutil.rmtree(copy, ignore_errors=True)
        bad_bags.spoil(bags[int(rng.integers(len(bags)))], copy, rng)
        return bad_bags.outcome(copy)

    yield from itertools.repeat(case)


KINDS = {
    "scenarios": scenario_cases,
    "messages": message_cases,
    "parameters": parameter_cases,
    "services": service_cases,
    "bags": bag_cases,
}


def main() -> int:
    """Try all kinds, one after the other, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--minutes", type=float, default=5.0, help="duration of all kinds together, in minutes"
    )
    parser.add_argument("--cases", type=int, help="number of cases per kind; replaces --minutes")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    options = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    console, found = Console(width=110), {}
    table = Table("kind", *("tried", "rejected", "accepted", "crashed", "hung"), "slowest, s",
                  "memory, MB", "growth, MB per 1000")  # fmt: skip
    for kind in options.kinds:
        tally, rng = Tally(), np.random.default_rng([options.seed, list(KINDS).index(kind)])
        with tempfile.TemporaryDirectory() as folder:
            cases = KINDS[kind](rng, Path(folder))
            first = next(cases)  # prepares what the cases need
            end = time.monotonic() + 60 * options.minutes / len(options.kinds)
            for number, case in enumerate(itertools.chain([first], cases)):
                if number == options.cases or (not options.cases and time.monotonic() > end):
                    break
                # A case that hangs forever ends the program with a traceback.
                faulthandler.dump_traceback_later(5 * HANGS, exit=True)
                tally.add(case)
            faulthandler.cancel_dump_traceback_later()
            cases.close()
        for complaint in tally.complaints[:5]:
            console.print(f"{kind}: {complaint}", markup=False)
        figures = found[kind] = tally.summary()
        table.add_row(
            kind, *(f"{v:.3g}" if isinstance(v, float) else str(v) for v in figures.values())
        )
    console.print(table)
    if options.json is not None:
        options.json.write_text(json.dumps({"seed": options.seed, **found}, indent=2) + "\n")
    return int(any(figures["crashed"] or figures["hung"] for figures in found.values()))


if __name__ == "__main__":
    sys.exit(main())
