"""Time and memory that a new process needs for its first solve.

    python -m gameinfer_ros.experiments.benchmark.fresh_process SCENARIO PARTICLES

prints one JSON object: `warm_up_s`, the time to compile the solver or to load it from the cache,
and `peak_mb`, the peak resident memory after the first solve of a belief.
"""

import json
import os
import subprocess
import sys
import tempfile
from time import perf_counter

import numpy as np

from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.machine import peak_memory_mb
from gameinfer_ros.inference import Belief
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver


def measure_start(effort: Effort) -> dict[str, float]:
    """Measure the warm-up of the solver in new processes, in s, without the imports."""
    if not effort.empty_cache:
        return {"filled_cache": _start("three_player", 1)["warm_up_s"]}
    with tempfile.TemporaryDirectory() as cache:
        return {
            name: _start("three_player", 1, NUMBA_CACHE_DIR=cache)["warm_up_s"]
            for name in ("empty_cache", "filled_cache")
        }


def measure_memory(effort: Effort) -> dict[str, float]:
    """Measure the peak resident memory, in MB, of a first solve, by the name of the scenario."""
    memory = {}
    for name in ("three_player", "five_player"):
        particles = effort.belief_particles or Scenario.load(name).inference.particles
        memory[name] = _start(name, particles)["peak_mb"]
    return memory


def _start(scenario: str, particles: int, **variables: str) -> dict[str, float]:
    module = "gameinfer_ros.experiments.benchmark.fresh_process"
    command = [sys.executable, "-m", module, scenario, str(particles)]
    output = subprocess.check_output(command, env={**os.environ, **variables}, text=True)
    return json.loads(output.splitlines()[-1])


def main(scenario_name: str, particles: str) -> None:
    """Warm up, solve a belief with the given number of particles, and print time and memory."""
    scenario = Scenario.load(scenario_name)
    solver = GameSolver(scenario.game, scenario.solver)
    start = perf_counter()
    solver.warm_up()
    warm_up_s = perf_counter() - start
    settings = scenario.inference.model_copy(update={"particles": int(particles)})
    belief = Belief(solver, scenario.seeds, settings, np.random.default_rng(0))
    belief.solve(0, scenario.initial_state)
    print(json.dumps({"warm_up_s": warm_up_s, "peak_mb": peak_memory_mb()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
