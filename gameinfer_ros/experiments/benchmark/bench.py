"""The command `gameinfer bench`: measure the solver and the belief on this machine."""

import argparse
import sys
from typing import Any

import numpy as np
from rich.console import Console

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.benchmark.belief_times import measure_beliefs
from gameinfer_ros.experiments.benchmark.circle import circle
from gameinfer_ros.experiments.benchmark.dgemm import Dgemm, use_one_thread
from gameinfer_ros.experiments.benchmark.effort import QUICK, Effort
from gameinfer_ros.experiments.benchmark.fresh_process import measure_memory, measure_start
from gameinfer_ros.experiments.benchmark.growth import draw, measure_growth, solved
from gameinfer_ros.experiments.benchmark.pass_times import measure_passes
from gameinfer_ros.experiments.benchmark.solve_times import compare_with_reference, measure_solves
from gameinfer_ros.experiments.benchmark.tables import tables, turned
from gameinfer_ros.lanes.array import WIDE
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, INTERRUPTED
from gameinfer_ros.names.text import json_text
from gameinfer_ros.runs.folder import BENCHMARK, FolderError, results_folder
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import Strategy
from gameinfer_ros.system.interruption import one_interruption
from gameinfer_ros.system.output import make_console, print_json

#: Numbers of players on the circle, and those whose games are solved until they converge.
PLAYERS, SOLVED_PLAYERS = range(2, 9), (3, 5)


def run(options: argparse.Namespace) -> int:
    """Run all benchmarks with the given options, and return the exit code.

    It may restart the process with the same arguments.
    """
    use_one_thread()
    try:
        with results_folder(
            options.out, BENCHMARK, "bench", overwrite=options.overwrite
        ) as options.out:
            return _run(options)
    except (FolderError, OSError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT


def _run(options: argparse.Namespace) -> int:
    console, out = make_console(options.json), options.out
    try:
        with one_interruption():
            figures = measure(QUICK if options.quick else Effort(), console)
    except KeyboardInterrupt:
        console.print("Interrupted.")
        return INTERRUPTED
    (out / "bench.json").write_text(json_text(figures, indent=2) + "\n")
    growth = {"unicycles": figures["growth"], "flat": figures["flat"]["growth"]}
    draw(growth, out / "growth.png")
    for table in tables(figures):
        console.print(table)
    console.print(f"Results: {out.resolve()}", soft_wrap=True)
    if options.json:
        print_json(figures)
    return DONE


def measure(effort: Effort, console: Console) -> dict[str, Any]:
    """Run all benchmarks, and return the figures; their names end with their units."""
    dgemm = Dgemm()
    figures: dict[str, Any] = {"machine": machine.describe(), "quick": effort is QUICK}
    console.print("Measuring the start-up with an empty and a filled cache ...")
    figures["compile_s"] = measure_start(effort)
    console.print("Measuring games of unicycles ...")
    figures |= measure_games(Scenario.load("three_player"), effort, dgemm)
    console.print("Measuring flat games ...")
    figures["flat"] = measure_games(Scenario.load("five_player"), effort, dgemm)
    figures["dgemm_speed_up_of_two_threads"] = dgemm.speed_up_of_two_threads(effort.repetitions)
    console.print("Measuring beliefs ...")
    figures["belief_step_ms"] = measure_beliefs(effort)
    console.print("Measuring memory ...")
    figures["strategy_bytes"] = strategy_bytes(Scenario.load("three_player"))
    figures["memory_mb"] = {**measure_memory(effort), "bench": machine.peak_memory_mb()}
    figures["dgemm_gflops"] = float(np.median(dgemm.rates))
    return figures


def measure_games(base: Scenario, effort: Effort, dgemm: Dgemm) -> dict[str, Any]:
    """Measure games of players on a circle with the dynamics and costs of `base`."""
    games = {n: circle(base, n) for n in PLAYERS}
    warm = {n: solved(game, effort) for n, game in games.items()}
    times = {
        str(n): measure_passes(game, warm[n].of_particles(WIDE).strategy, effort, dgemm)
        for n, game in games.items()
    }
    solves = {str(n): measure_solves(games[n], effort) for n in SOLVED_PLAYERS}
    return {
        **turned(times),
        **turned(solves),
        "reference": {str(n): compare_with_reference(games[n], effort) for n in SOLVED_PLAYERS},
        "growth": measure_growth(base, warm, effort),
    }


def strategy_bytes(base: Scenario) -> dict[str, int]:
    """Return the size of one particle's strategies, in bytes, by the number of players."""
    sizes = {}
    for n in PLAYERS:
        game = circle(base, n).game
        nx, nu = game.players.n_states, game.players.n_inputs
        arrays = Strategy.zeros(0, game.horizon, nx, nu, 1).arrays
        sizes[str(n)] = sum(array.nbytes for array in arrays)
    return sizes
