"""Measure the running stack: start-up, latency, memory, late steps, and belief updates.

    ./dev exec python benchmarks/stack.py [--scenario NAME-or-FILE] [--runs N] [--json FILE]

Each run is `gameinfer run --time realtime` with another seed, in a random ROS domain.
`gameinfer bench` measures the solver and the belief without ROS.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rich.console import Console
from rich.table import Table

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.benchmark.belief_times import EARLY
from gameinfer_ros.experiments.benchmark.stopwatch import spread
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.scenario import Scenario, ScenarioError, find

#: Step in which memory is measured.
MEMORY_STEP = 50


class StackFigures:
    """The figures that the nodes report in all runs, step by step."""

    def __init__(self) -> None:
        self.first_control_s: list[float] = []  # from the start of each run to its first inputs
        self.memory_mb: dict[str, float] = {}  # resident memory of each process in the last run
        self.late_steps = self.steps = 0
        self._latencies_ms: dict[str, list[float]] = {}
        self._beliefs: dict[str, list[tuple[float, int, int]]] = {}
        self._missed_deadlines: list[int] = []
        self._simulated = self._inferred = -1

    def begin_run(self) -> None:
        """Begin the next run."""
        self._missed_deadlines.append(0)
        self._simulated = self._inferred = -1

    def see_simulator(self, figures: Mapping[str, str]) -> int | None:
        """Add the newest figures of the simulator, and return their step if it is new."""
        step = int(figures.get("step", -1))
        if step <= max(self._simulated, 0):  # step 0 is the start-up
            return None
        self._simulated = step
        for key, value in figures.items():
            if key.endswith("/latency_ms"):
                self._latencies_ms.setdefault(key.split("/")[0], []).append(float(value))
        return step

    def see_inference(self, figures: Mapping[str, str]) -> None:
        """Add the newest figures of the inference, if they belong to a new step."""
        step = int(figures.get("step", -1))
        if step <= self._inferred:
            return
        self._inferred = step
        when = "first_step" if step == 0 else f"steps_1_to_{EARLY}"
        if step > EARLY:
            when = "later_steps"
        updated, particles = int(figures["updated_particles"]), int(figures["particles"])
        update = float(figures["solve_ms"]), updated, particles
        self._beliefs.setdefault(when, []).append(update)
        self._missed_deadlines[-1] = int(figures["missed_deadlines"])

    def summary(self) -> dict[str, Any]:
        """Summarise all runs."""
        return {
            "first_control_s": spread(self.first_control_s),
            "state_to_control_ms": {
                player: spread(samples) for player, samples in self._latencies_ms.items()
            },
            "belief": {when: summarised(figures) for when, figures in self._beliefs.items()},
            "missed_deadlines": sum(self._missed_deadlines),
            "memory_mb": self.memory_mb,
            "late_steps": self.late_steps,
            "steps": self.steps,
        }


def summarised(updates: Sequence[tuple[float, int, int]]) -> dict[str, Any]:
    """Summarise belief updates, each with its time in ms, updated particles, and all particles."""
    solve_ms, updated, particles = np.array(updates).T
    shares = updated / particles
    return {
        "updates": len(updates),
        "solve_ms": spread(solve_ms),
        "updated_particles": {"median": float(np.median(updated)), "least": int(updated.min())},
        "updated_share": {"median": float(np.median(shares)), "least": float(shares.min())},
    }


def measure(scenario: Path, runs: int) -> dict[str, Any]:
    """Play runs in real time, and return their figures."""
    domain = random.randrange(1, 100)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    figures = StackFigures()
    for seed in range(runs):
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        recorder = Recorder(
            "observer",
            context=context,
            parameter_overrides=[Parameter("scenario", value=str(scenario))],
        )
        with tempfile.TemporaryDirectory() as out:
            command = [
                *(sys.executable, "-m", "gameinfer_ros", "run", "--scenario", str(scenario)),
                *("--time", "realtime", "--seed", str(seed), "--out", out, "--json"),
            ]
            watch(command, domain, recorder, figures)
        recorder.destroy_node()
        context.try_shutdown()
    return figures.summary()


def watch(command: Sequence[str], domain: int, recorder: Recorder, figures: StackFigures) -> None:
    """Start a run, and collect the figures of its nodes until it is over."""
    executor = SingleThreadedExecutor(context=recorder.context)
    executor.add_node(recorder)
    start = time.perf_counter()
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    figures.begin_run()
    controlled = False
    while process.poll() is None:
        executor.spin_once(timeout_sec=0.05)
        if recorder.record.inputs and not controlled:
            controlled = True
            figures.first_control_s.append(time.perf_counter() - start)
        figures.see_inference(recorder.figures.get("/inference", {}))
        if figures.see_simulator(recorder.figures.get("/simulator", {})) == MEMORY_STEP:
            figures.memory_mb = resident_memory(process.pid)
    executor.shutdown()
    output, _ = process.communicate()
    if process.returncode != 0:
        sys.exit(f"gameinfer run ended with exit code {process.returncode}")
    result = json.loads(output)
    figures.late_steps += result["late_steps"]
    figures.steps += result["steps"]


def resident_memory(parent: int) -> dict[str, float]:
    """Return the resident memory, in MB, of a process and its children, by node."""
    memory = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "status").read_text()
            words = (folder / "cmdline").read_text().split("\0")
        except OSError:  # the process has ended
            continue
        fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
        if parent in (int(fields["PPid"]), int(fields["Pid"])) and "VmRSS" in fields:
            name = next((w.split(":=")[1] for w in words if "__node:=" in w), "orchestrator")
            memory[name] = int(fields["VmRSS"].split()[0]) / 1024
    return memory


def show(figures: dict[str, Any], console: Console) -> None:
    """Print all figures as a table."""
    table = Table("figure", "value")

    def add(prefix: str, value: Any) -> None:
        if isinstance(value, dict):
            for key, item in value.items():
                add(f"{prefix} {key}".strip(), item)
        else:
            table.add_row(prefix, f"{value:.3g}" if isinstance(value, float) else str(value))

    add("", figures)
    console.print(table)


def main() -> None:
    """Measure the stack, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="three_player", metavar="NAME-or-FILE")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the figures to this file"
    )
    options = parser.parse_args()
    if options.runs < 1:
        parser.error(f"--runs: {options.runs} is not allowed: it must be at least 1")
    try:
        scenario = find(options.scenario).resolve()
        particles = Scenario.load(scenario).inference.particles
    except ScenarioError as error:
        sys.exit(str(error))
    figures = {
        "machine": machine.describe(),
        "scenario": scenario.stem,
        "particles": particles,
        **measure(scenario, options.runs),
    }
    show(figures, Console())
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
