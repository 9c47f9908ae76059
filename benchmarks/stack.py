"""Measures the running stack: start-up, latency, memory, late steps, and updates of the belief.

    ./dev exec python benchmarks/stack.py [--scenario NAME-or-FILE] [--runs N] [--json FILE]

Every run is `gameinfer run --time realtime` with a seed of its own, in a ROS domain drawn at
random. What a solver and a belief take without ROS is told by `gameinfer bench`.
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
from typing import Any, NamedTuple

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rich.console import Console
from rich.table import Table

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.benchmark.stopwatch import spread
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.scenario import Scenario, ScenarioError, find

#: The last step in which a belief still makes up its mind.
EARLY = 10

#: The step in which memory is looked at.
MEMORY_STEP = 50


class StackFigures:
    """What the nodes say of themselves in all runs, step by step."""

    def __init__(self) -> None:
        self.first_control_s: list[float] = []
        self.memory_mb: dict[str, float] = {}
        self.late_steps = self.steps = 0
        self._latencies_ms: dict[str, list[float]] = {}
        self._beliefs: dict[str, list[BeliefFigures]] = {}
        self._missed_deadlines: list[int] = []
        self._simulated = self._inferred = -1

    def begin_run(self) -> None:
        """Expect the steps of another run."""
        self._missed_deadlines.append(0)
        self._simulated = self._inferred = -1

    def see_simulator(self, figures: Mapping[str, str]) -> int | None:
        """Take in the simulator's newest figures; returns their step if it is a new one."""
        step = int(figures.get("step", -1))
        if step <= max(self._simulated, 0):  # step 0 is the start-up
            return None
        self._simulated = step
        for key, value in figures.items():
            if key.endswith("/latency_ms"):
                self._latencies_ms.setdefault(key.split("/")[0], []).append(float(value))
        return step

    def see_inference(self, figures: Mapping[str, str]) -> None:
        """Take in the inference's newest figures, if they are those of a new step."""
        step = int(figures.get("step", -1))
        if step <= self._inferred:
            return
        self._inferred = step
        when = "first_step" if step == 0 else f"steps_1_to_{EARLY}"
        if step > EARLY:
            when = "later_steps"
        self._beliefs.setdefault(when, []).append(
            BeliefFigures(
                float(figures["solve_ms"]),
                int(figures["updated_particles"]),
                int(figures["particles"]),
            )
        )
        self._missed_deadlines[-1] = int(figures["missed_deadlines"])

    def summary(self) -> dict[str, Any]:
        """All figures of all runs."""
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


class BeliefFigures(NamedTuple):
    """One update of the belief: how long solving took, and how many particles it reached."""

    solve_ms: float
    updated: int
    particles: int


def summarised(updates: Sequence[BeliefFigures]) -> dict[str, Any]:
    """Figures of some updates of the belief."""
    updated = [update.updated for update in updates]
    shares = [update.updated / update.particles for update in updates]
    return {
        "updates": len(updates),
        "solve_ms": spread([update.solve_ms for update in updates]),
        "updated_particles": {"median": float(np.median(updated)), "least": min(updated)},
        "updated_share": {"median": float(np.median(shares)), "least": min(shares)},
    }


def measure(scenario: Path, runs: int) -> dict[str, Any]:
    """Figures of the real processes in real time."""
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
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(recorder)
        with tempfile.TemporaryDirectory() as out:
            command = [
                *(
                    sys.executable,
                    "-m",
                    "gameinfer_ros",
                    "run",
                    "--scenario",
                    str(scenario),
                ),
                *("--time", "realtime", "--seed", str(seed), "--out", out, "--json"),
            ]
            watch(command, domain, recorder, executor, figures)
        executor.shutdown()
        recorder.destroy_node()
        context.try_shutdown()
    return figures.summary()


def watch(
    command: Sequence[str],
    domain: int,
    recorder: Recorder,
    executor: SingleThreadedExecutor,
    figures: StackFigures,
) -> None:
    """Start a run, and take in what its nodes say until it is over."""
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
    output, _ = process.communicate()
    if process.returncode != 0:
        sys.exit(f"gameinfer run ended with exit code {process.returncode}")
    result = json.loads(output.splitlines()[-1])
    figures.late_steps += result["late_steps"]
    figures.steps += result["steps"]


def resident_memory(parent: int) -> dict[str, float]:
    """Resident memory, in MB, of a process and its children, by what they run."""
    memory = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "status").read_text()
            words = (folder / "cmdline").read_text().split("\0")
        except OSError:  # ended meanwhile
            continue
        fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
        if parent in (int(fields["PPid"]), int(fields["Pid"])) and "VmRSS" in fields:
            name = next((w.split(":=")[1] for w in words if "__node:=" in w), "orchestrator")
            memory[name] = int(fields["VmRSS"].split()[0]) / 1024
    return memory


def show(figures: dict[str, Any], console: Console) -> None:
    """Print all figures as one table."""
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
    """Measure everything and print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="three_player", metavar="NAME-or-FILE")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write the figures to this file too"
    )
    options = parser.parse_args()
    if options.runs < 1:
        parser.error(f"--runs: {options.runs} is not at least 1")
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
