"""Solve random games, ordinary and extreme ones, and count how the solves end.

    ./dev exec python benchmarks/robustness.py [--cases N] [--seed N] [--json FILE]

A case is one game with one initial strategy. Each class gets the same number of cases, in games of
`PARTICLES` cases. The exit code is 1 if a particle without the status `NOT_FINITE` has numbers that
are not finite, or if the result of a particle depends on invalid particles next to it. The same
seed draws the same games.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.append(str(Path(__file__).resolve().parents[1] / "test/support"))

from extreme_games import CLASSES, draw

from gameinfer_ros.solver import GameSolver, Status

#: Number of initial strategies of each game: two blocks.
PARTICLES = 16

#: Possible statuses of a solution without a deadline.
ENDS = tuple(status for status in Status if status is not Status.NOT_REACHED)


def figures_of(kind: str, games: int, seed: int) -> dict[str, Any]:
    """Solve the games of a class, and return the share of each status and the number of errors."""
    counts, not_finite, changed = dict.fromkeys(ENDS, 0), 0, 0
    for number in track(range(games), description=kind):
        rng = np.random.default_rng([seed, list(CLASSES).index(kind), number])
        game, settings, x0, initial = draw(kind, rng, PARTICLES)
        solver = GameSolver(game, settings)
        solution = solver.solve(x0, initial)
        for status in ENDS:
            counts[status] += int((solution.status == status).sum())
        numbers = np.concatenate(solution.strategy.flat, axis=1)
        finite = np.isfinite(numbers).all(axis=1)
        not_finite += int((~finite & (solution.status != Status.NOT_FINITE)).sum())
        initial.u_ref[..., 1::2] = np.nan
        beside = np.concatenate(solver.solve(x0, initial).strategy.flat, axis=1)
        changed += not np.array_equal(numbers[::2], beside[::2], equal_nan=True)
    cases = games * PARTICLES
    return {
        "cases": cases,
        **{status.name.lower(): counts[status] / cases for status in ENDS},
        "not_finite_unmarked": not_finite,
        "games_with_changed_neighbours": changed,
    }


def main() -> None:
    """Solve all cases, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--cases", type=int, default=32_000, help="number of cases of all classes together"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    options = parser.parse_args()
    games = -(-options.cases // (PARTICLES * len(CLASSES)))
    if games < 1:
        parser.error(f"--cases: {options.cases} is not allowed: it must be at least 1")
    figures = {kind: figures_of(kind, games, options.seed) for kind in CLASSES}
    table = Table("class", "extreme in", *(status.name.lower() for status in ENDS))
    for kind, row in figures.items():
        shares = (row[status.name.lower()] for status in ENDS)
        table.add_row(kind, CLASSES[kind], *(f"{100 * share:.1f} %" for share in shares))
    console = Console()
    console.print(table)
    broken = sum(
        row["not_finite_unmarked"] + row["games_with_changed_neighbours"]
        for row in figures.values()
    )
    cases = sum(row["cases"] for row in figures.values())
    console.print(f"{cases} cases; not finite without a mark, or changed by neighbours: {broken}")
    if options.json:
        content = {"seed": options.seed, "classes": figures}
        options.json.write_text(json.dumps(content, indent=2) + "\n")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
