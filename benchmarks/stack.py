"""Measures the main job: solver, belief and the running stack, all in one go.

    ./dev exec python benchmarks/main_job.py [--runs N] [--json FILE]

Times depend on the machine and on what else it does. Compare figures of one invocation with one
another, such as the compiled solver with the NumPy reference.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rich.console import Console
from rich.table import Table

from gameinfer_ros.inference import Belief
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.run_seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Strategy, reference


def timed(work: Any, *arguments: Any) -> tuple[float, Any]:
    """Milliseconds that a call took, and what it returned."""
    start = time.perf_counter()
    result = work(*arguments)
    return 1e3 * (time.perf_counter() - start), result


def spread(samples: list[float]) -> dict[str, float]:
    """Median, 99th percentile and maximum."""
    return {
        "median": float(np.median(samples)),
        "p99": float(np.percentile(samples, 99)),
        "max": float(np.max(samples)),
    }


def measure_solver(scenario: Scenario) -> dict[str, float]:
    """Time per particle, from seeds and warm-started, against the NumPy reference."""
    game, x0 = scenario.game, scenario.initial_state
    solver = IterativeLQ(game, scenario.solver)
    solver.warm_up()
    count = scenario.inference.particles
    seeds = scenario.seeds.sample(np.random.default_rng(0), game.players, game.horizon, count)
    cold_ms, cold = timed(solver.solve, x0, Strategy.from_inputs(0, x0, seeds))
    x1 = cold.strategy.x_ref[1, :, 0]
    warm_ms, warm = timed(solver.solve, x1, cold.strategy.take([0] * count).advanced(1))
    one_ms, one = timed(solver.solve, x1, cold.strategy.take([0]).advanced(1))
    reference.approximate(
        game, one.strategy.x_ref[..., 0], one.strategy.u_ref[..., 0], 1, scenario.solver
    )  # compiles
    numpy_ms, numpy = timed(reference.solve, game, x0, seeds[..., 0], scenario.solver)
    per_iteration = cold_ms / cold.iterations.sum()
    return {
        "cold_ms_per_particle": cold_ms / count,
        "cold_iterations": float(cold.iterations.mean()),
        "warm_ms_per_particle": warm_ms / count,
        "warm_iterations": float(warm.iterations.mean()),
        "warm_ms_alone": one_ms,
        "iteration_ms_per_particle": per_iteration,
        "reference_iteration_ms": numpy_ms / numpy.iterations,
        "speed_up_over_reference": numpy_ms / numpy.iterations / per_iteration,
    }


def measure_belief(scenario: Scenario, runs: int) -> dict[str, Any]:
    """Time of each belief update (weigh, combine, solve) while humans play an equilibrium."""
    solver = IterativeLQ(scenario.game, scenario.solver)
    first, later = [], []
    for run in range(runs):
        seeds = RunSeeds.of_run(run)
        humans = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
        belief = Belief(
            solver,
            scenario.seeds,
            scenario.inference,
            np.random.default_rng(seeds.inference),
            robot_plays=False,
        )
        x = scenario.initial_state
        ms, _ = timed(belief.solve, 0, x)
        first.append(ms)
        for step in range(scenario.steps - 1):
            u = humans.solve(step, x).inputs(step, x)[:, 0]
            x_next = scenario.game.step(x, u)
            start = time.perf_counter()
            belief.weigh(step, x, x_next)
            belief.combine_duplicates()
            belief.solve(step + 1, x_next)
            later.append(1e3 * (time.perf_counter() - start))
            x = x_next
    return {"first_step_ms": spread(first), "later_steps_ms": spread(later)}


def measure_stack(name: str, runs: int) -> dict[str, Any]:
    """Start-up, latency, memory and late steps of the real processes in realtime."""
    domain = random.randrange(1, 100)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    first_control, latencies, late, steps = [], {}, 0, 0
    memory: dict[str, float] = {}
    for run in range(runs):
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        recorder = Recorder(
            "observer", context=context, parameter_overrides=[Parameter("scenario", value=name)]
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(recorder)
        with tempfile.TemporaryDirectory() as out:
            start = time.perf_counter()
            command = [
                *(sys.executable, "-m", "gameinfer_ros.cli", "run", "--scenario", name),
                *("--time", "realtime", "--seed", str(run), "--out", out, "--json"),
            ]
            process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
            seen = -1
            while process.poll() is None:
                executor.spin_once(timeout_sec=0.05)
                if len(recorder.record.inputs) and len(first_control) == run:
                    first_control.append(time.perf_counter() - start)
                figures = recorder.figures.get("/simulator", {})
                if int(figures.get("step", -1)) > max(seen, 0):  # step 0 is the start-up
                    seen = int(figures["step"])
                    for key, value in figures.items():
                        if key.endswith("/latency_ms"):
                            latencies.setdefault(key.split("/")[0], []).append(float(value))
                    if seen == 50:
                        memory = resident_memory(process.pid)
            assert process.stdout is not None
            result = json.loads(process.stdout.read().splitlines()[-1])
        late, steps = late + result["late_steps"], steps + result["steps"]
        executor.shutdown()
        recorder.destroy_node()
        context.try_shutdown()
    return {
        "first_control_s": spread(first_control),
        "state_to_control_ms": {player: spread(ms) for player, ms in latencies.items()},
        "memory_mb": memory,
        "late_share": late / steps,
        "steps": steps,
    }


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
    parser.add_argument("--scenario", default="three_player")
    parser.add_argument("--runs", type=int, default=3, help="runs of the belief and the stack")
    parser.add_argument("--json", type=Path, help="write the figures to this file too")
    options = parser.parse_args()
    scenario = Scenario.load(options.scenario)
    figures = {
        "machine": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "solver": measure_solver(scenario),
        "belief_update": measure_belief(scenario, options.runs),
        "stack": measure_stack(options.scenario, options.runs),
    }
    show(figures, Console())
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
