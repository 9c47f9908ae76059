"""Compare beliefs with bounded updates to beliefs that are always solved until they converge.

    ./dev exec python benchmarks/bounded_updates.py [--scenario NAME] [--runs N] [--json FILE]
        [--max-iterations N] [--patience N] [--heavy P]

Plays the same runs twice, without ROS: with and without the bounds `max_iterations` and `patience`.
Bounds that the scenario does not set come from the options. `--heavy` replaces the probability from
which particles are not bounded. Prints the mean costs of both, and the mean of their difference,
with standard errors.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario


def with_bounds(scenario: Scenario, **bounds: float | None) -> Scenario:
    """Return a copy of the scenario with other bounds of belief updates."""
    inference = scenario.inference.model_copy(update=bounds)
    return scenario.model_copy(update={"inference": inference})


def costs_of(scenario: Scenario, runs: int, description: str) -> np.ndarray:
    """Play runs, and return the cost (runs, N) of each run to each player."""
    seeds = track(range(runs), description=description)
    return np.array([closed_loop.run(scenario, "map", seed).costs for seed in seeds])


def summary(costs: np.ndarray) -> dict[str, Any]:
    """Return the mean and standard error of costs (runs, N) per player, and the largest cost."""
    return {
        "mean": costs.mean(axis=0).tolist(),
        "standard_error": (costs.std(axis=0, ddof=1) / np.sqrt(len(costs))).tolist(),
        "largest": float(costs.max()),
    }


def main() -> None:
    """Play all runs, and print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="five_player")
    parser.add_argument("--runs", type=int, default=32, help="number of runs, at least 2")
    parser.add_argument("--max-iterations", type=int, default=4)
    parser.add_argument("--patience", type=int, default=20)
    parser.add_argument("--heavy", type=float, help="1 to bound all particles")
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    options = parser.parse_args()
    if options.runs < 2:
        parser.error(f"--runs: {options.runs} is not allowed: it must be at least 2")
    scenario = Scenario.load(options.scenario)
    bounds = {
        "max_iterations": scenario.inference.max_iterations or options.max_iterations,
        "patience": scenario.inference.patience or options.patience,
        "heavy": scenario.inference.heavy if options.heavy is None else options.heavy,
    }
    bounded = costs_of(with_bounds(scenario, **bounds), options.runs, "bounded")
    unbounded = with_bounds(scenario, max_iterations=None, patience=None)
    to_the_end = costs_of(unbounded, options.runs, "to the end")
    figures = {
        "scenario": options.scenario,
        "runs": options.runs,
        **bounds,
        "bounded": summary(bounded),
        "to_the_end": summary(to_the_end),
        "difference": summary(bounded - to_the_end),
    }
    table = Table("", *scenario.game.players.names, "largest")
    for key in ("bounded", "to_the_end", "difference"):
        row = figures[key]
        pairs = zip(row["mean"], row["standard_error"], strict=True)
        cells = [f"{mean:.1f} +- {error:.1f}" for mean, error in pairs]
        table.add_row(key.replace("_", " "), *cells, f"{row['largest']:.0f}")
    Console().print(table)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
