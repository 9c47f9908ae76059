"""Run the stack for a long time, and check whether anything grows, slows down or is late.

    ./dev exec python benchmarks/soak.py --time lockstep --steps 100000 [--json FILE]
    ./dev exec python benchmarks/soak.py --time realtime --minutes 30 [--json FILE]

The nodes are started once, and the services `~/reset` begin one run after the other. Every fifth
run has new seeds, and every tenth is aborted half-way. Processor times are compared with those of a
constant piece of work, so that they are meaningful on a busy machine too. Late steps and gaps are
meaningful only on an idle machine.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from std_srvs.srv import Trigger

from gameinfer_ros.experiments import machine
from gameinfer_ros.names.choices import LOCKSTEP, REALTIME
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all
from gameinfer_ros.scenario import Scenario, ScenarioError, find

#: Name of the node of this process.
WATCHER = "watcher"

#: Timeout of anything that is awaited, in s.
PATIENCE = 120.0

#: Number of runs from one with new seeds to the next, and from one that is aborted to the next.
NEW_SEEDS, ABORTED = 5, 10

#: Share of the steps that is excluded at the beginning, while caches fill.
WARM_UP = 0.1


class Usage(NamedTuple):
    """The resources that a process uses."""

    memory_kb: int  # anonymous resident memory, in kB: neither in files nor shared
    cpu_s: float  # processor time so far, in s
    files: int  # number of open files
    threads: int

    @classmethod
    def of(cls, pid: int) -> Usage:
        """Read the current usage of a process."""
        folder = Path("/proc", str(pid))
        lines = (folder / "status").read_text().splitlines()
        status = dict(line.split(":", 1) for line in lines)
        # The name of the program may contain anything; it ends with the last bracket.
        times = (folder / "stat").read_text().rpartition(")")[2].split()[11:13]
        return cls(
            int(status["RssAnon"].split()[0]),
            sum(map(int, times)) / os.sysconf("SC_CLK_TCK"),
            len(list((folder / "fd").iterdir())),
            int(status["Threads"]),
        )


class Sample(NamedTuple):
    """The state of the stack after a run."""

    steps: int  # so far
    entities: int  # publishers, subscribers, services and clients in the whole graph
    yardstick_ms: float  # processor time of a constant piece of work, in ms
    usage: dict[str, Usage]  # of each process, by the name of its node


class Soak:
    """A stack of nodes that plays one run after the other, and its monitor.

    Args:
        scenario_file: file of the scenario.
        time_mode: `lockstep` or `realtime`.
        particles: number of particles; 0 for that of the scenario.
        folder: folder for logs.
    """

    def __init__(self, scenario_file: Path, time_mode: str, particles: int, folder: Path) -> None:
        self.samples: list[Sample] = []  # one per finished run
        self.steps = self.late_steps = self.runs = 0  # so far, in all finished runs
        self.longest_gap_s = 0.0  # between the arrivals of two states of a run
        self._scenario = Scenario.load(scenario_file)
        domain = random.SystemRandom().randrange(1, 100)
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        self._stack = ExitStack()
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        self._stack.callback(context.try_shutdown)
        self._watcher = Recorder(
            WATCHER,
            context=context,
            parameter_overrides=[Parameter("scenario", value=str(scenario_file))],
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._watcher)
        common = {"scenario": str(scenario_file), "time": time_mode}
        humans = self._scenario.game.players.names[1:]
        # The players, the inference, and this process.
        subscribers = {"subscribers": len(humans) + 3}
        self._nodes: list[NodeProcess] = []
        self._stack.callback(stop_all, self._nodes)
        for name, module, parameters in (
            ("simulator", "simulator", subscribers),
            ("inference", "inference", {"particles": particles}),
            ("robot_planner", "robot_planner", {}),
            *((f"{human}_agent", "human_agent", {"player": human}) for human in humans),
        ):
            self._nodes.append(NodeProcess(name, module, {**common, **parameters}, folder))
        self._reset = {
            node.name: self._watcher.create_client(Trigger, f"{node.name}/reset")
            for node in self._nodes
            if node.name != "robot_planner"  # it draws nothing
        }

    def close(self) -> None:
        """Stop all nodes."""
        self._stack.close()

    def play(self) -> None:
        """Play one run, take a sample, and begin the next run."""
        end = self._scenario.steps
        if self.runs % ABORTED == ABORTED - 1:
            end //= 2
        seen, last = 0, 0.0

        def over() -> bool:
            nonlocal seen, last
            now, before, seen = time.monotonic(), seen, self._watcher.record.steps
            if seen > before > 0:
                self.longest_gap_s = max(self.longest_gap_s, now - last)
            if seen > before:
                last = now
            return seen >= end

        self._wait(over, f"{end} steps of run {self.runs}")
        self._wait(lambda: "late_steps" in self._figures, "diagnostics of the simulator")
        self.steps += end
        self.late_steps += int(self._figures["late_steps"])
        self.runs += 1
        self.samples.append(self._sample())
        if self.runs % NEW_SEEDS == 0:
            for name in self._reset.keys() - {"simulator"}:
                self._call(name)
        record = self._watcher.record
        self._call("simulator")
        self._wait(lambda: self._watcher.record is not record, "a new run")

    @property
    def _figures(self) -> dict[str, str]:
        return self._watcher.figures.get("/simulator", {})

    def _call(self, name: str) -> None:
        client = self._reset[name]
        self._wait(client.service_is_ready, f"the service {name}/reset")
        answer = client.call_async(Trigger.Request())
        self._wait(answer.done, f"an answer of {name}/reset")
        if not answer.result().success:
            raise RuntimeError(f"{name}/reset failed: {answer.result().message}")

    def _wait(self, condition: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self._executor.spin_once(timeout_sec=0.1)
            for node in self._nodes:
                if node.exit_code is not None:
                    raise RuntimeError(f"{node.name} has ended:\n{node.last_output()}")
            if time.monotonic() > deadline:
                raise RuntimeError(f"timeout: waited {PATIENCE} s for {what}")

    def _sample(self) -> Sample:
        watcher = self._watcher
        nodes = watcher.get_node_names_and_namespaces()
        entities = sum(
            len(getattr(watcher, f"get_{kind}_names_and_types_by_node")(*node))
            for node in nodes
            for kind in ("publisher", "subscriber", "service", "client")
        )
        pids = {node.name: node.pid for node in self._nodes} | {WATCHER: os.getpid()}
        usage = {name: Usage.of(pid) for name, pid in pids.items()}
        return Sample(self.steps, entities, yardstick_ms(), usage)


def yardstick_ms() -> float:
    """Measure the processor time of a constant piece of work, in ms.

    On a busy machine, the same work takes more processor time.
    """
    start = time.process_time()
    sum(i * i for i in range(100_000))
    return 1e3 * (time.process_time() - start)


def slope(steps: np.ndarray, memory_kb: np.ndarray) -> float:
    """Fit the growth of memory (S,), in kB per 1000 steps."""
    per_step = np.polyfit(steps, memory_kb, 1)[0] if len(steps) > 2 else np.nan
    return round(float(1000 * per_step), 2)


def machine_ratio(samples: Sequence[Sample]) -> float:
    """Return how much longer the same work took in the last quarter than in the first."""
    times, quarter = [s.yardstick_ms for s in samples], max(1, len(samples) // 4)
    return float(np.mean(times[-quarter:]) / np.mean(times[:quarter]))


def trend(kept: Sequence[Sample], name: str) -> dict[str, Any]:
    """Return the figures of a process; each pair is from the beginning and the end."""
    steps = np.array([s.steps for s in kept], dtype=float)
    memory = np.array([s.usage[name].memory_kb for s in kept], dtype=float)
    cpu_s = np.array([s.usage[name].cpu_s for s in kept])
    quarter = max(1, len(kept) // 4)
    half = len(kept) // 2

    def step_ms(first: int, last: int) -> float:
        return float(1e3 * (cpu_s[last] - cpu_s[first]) / max(1.0, steps[last] - steps[first]))

    begin, end = step_ms(0, quarter), step_ms(-1 - quarter, -1)
    return {
        "memory_mb": [round(float(memory[k]) / 1024, 1) for k in (0, -1)],
        "kb_per_1000_steps": slope(steps, memory),
        "in_the_second_half": slope(steps[half:], memory[half:]),
        "cpu_ms_per_step": [round(begin, 3), round(end, 3)],
        "cpu_ratio": round(end / begin / machine_ratio(kept), 3) if begin else None,
        "files": [kept[0].usage[name].files, kept[-1].usage[name].files],
        "threads": [kept[0].usage[name].threads, kept[-1].usage[name].threads],
    }


def summary(soak: Soak, seconds: float) -> dict[str, Any]:
    """Return all figures; each pair is from the beginning, after the warm-up, and the end."""
    kept = [s for s in soak.samples if s.steps >= WARM_UP * soak.samples[-1].steps]
    return {
        "steps": soak.steps,
        "runs": soak.runs,
        "seconds": round(seconds),
        "late_steps": soak.late_steps,
        "late_share": soak.late_steps / soak.steps,
        "longest_gap_s": round(soak.longest_gap_s, 3),
        "entities": [kept[0].entities, kept[-1].entities],
        "machine_ratio": round(machine_ratio(kept), 3),
        "processes": {name: trend(kept, name) for name in kept[-1].usage},
    }


def show(figures: dict[str, Any], console: Console) -> None:
    """Print all figures."""
    whole = Table("figure", "value")
    for key, value in figures.items():
        if key != "processes":
            whole.add_row(key, str(value))
    console.print(whole)
    processes = figures["processes"]
    table = Table("figure", *processes)
    for figure in processes[WATCHER]:
        table.add_row(figure, *(str(of_process[figure]) for of_process in processes.values()))
    console.print(table)


def main() -> None:
    """Play the requested number of steps or minutes, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="three_player", metavar="NAME-or-FILE")
    parser.add_argument("--time", choices=(LOCKSTEP, REALTIME), default=LOCKSTEP)
    parser.add_argument(
        "--particles", type=int, default=0, help="number of particles; 0 for that of the scenario"
    )
    parser.add_argument("--steps", type=int, default=0, help="minimum number of steps")
    parser.add_argument("--minutes", type=float, default=0.0, help="minimum duration in minutes")
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the figures to this file"
    )
    options = parser.parse_args()
    if options.steps < 1 and options.minutes <= 0:
        parser.error("--steps or --minutes must be above 0")
    try:
        scenario = find(options.scenario).resolve()
        Scenario.load(scenario)
    except ScenarioError as error:
        sys.exit(str(error))
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    console = Console(markup=False)
    if not console.is_terminal:
        console.width = 140
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(scenario, options.time, options.particles, Path(folder))
        start, failure = time.monotonic(), ""
        try:
            with Progress(console=console) as progress:
                steps = progress.add_task("steps", total=options.steps or None)
                while soak.steps < options.steps or time.monotonic() - start < 60 * options.minutes:
                    soak.play()
                    progress.update(steps, completed=soak.steps)
        except KeyboardInterrupt:
            console.print("Interrupted. The figures so far:")
        except RuntimeError as error:
            failure = str(error)
        finally:
            soak.close()
    if not soak.samples:
        sys.exit(failure or "no run has finished")
    figures = {
        "machine": machine.describe(),
        "scenario": scenario.stem,
        "time": options.time,
        "particles": options.particles,
        **summary(soak, time.monotonic() - start),
    }
    show(figures, console)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")
    if failure:
        sys.exit(failure)


if __name__ == "__main__":
    main()
