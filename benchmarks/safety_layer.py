"""Compare the runs of two studies of planning, without and with the safety layer.

The folders come from `gameinfer planning` and `gameinfer planning --safety` with the same scenario.
Only runs that are in both folders are compared. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from gameinfer_ros.experiments.planning.planning_study import COLLISION, SAFETY_COLUMNS
from gameinfer_ros.experiments.study import numbers, statistics
from gameinfer_ros.experiments.study.folder import RUNS
from gameinfer_ros.names.choices import BASELINE, MAP

Run = dict[str, str]


def read(folder: Path) -> dict[tuple[str, str], Run]:
    """Read the runs of a folder, by planner and seed."""
    with (folder / RUNS).open(newline="", encoding="utf-8") as file:
        return {(run["planner"], run["seed"]): run for run in csv.DictReader(file)}


def lines(plain: list[Run], safe: list[Run]) -> list[tuple[str, str]]:
    """Return the rows of the table for the runs with one planner, as names and values."""
    costs = [name for name in plain[0] if name.startswith("cost_")]
    extra = numbers(safe, costs) - numbers(plain, costs)
    half = statistics.half_interval(extra)
    braked, limited = numbers(safe, SAFETY_COLUMNS).T
    before, after = (numbers(runs, ["smallest_distance"])[:, 0] for runs in (plain, safe))
    same = [
        a["trajectory_sha256"] == b["trajectory_sha256"] for a, b in zip(plain, safe, strict=True)
    ]
    return [
        ("runs", f"{len(safe)}"),
        ("identical runs", f"{sum(same)}"),
        ("runs with braking", f"{np.count_nonzero(braked)}"),
        ("braked steps per run", f"{braked.mean():.1f}"),
        ("limited steps per run", f"{limited.mean():.1f}"),
        *(
            (f"extra cost of {name[5:]} per run", f"{round(mean):+d} ± {interval:.0f}")
            for name, mean, interval in zip(costs, extra.mean(axis=0), half, strict=True)
        ),
        (f"runs below {COLLISION} m", f"{_share(before, COLLISION)} → {_share(after, COLLISION)}"),
        ("runs below 0.3 m", f"{_share(before, 0.3)} → {_share(after, 0.3)}"),
        ("smallest distance", f"{before.min():.2f} m → {after.min():.2f} m"),
        ("median smallest distance", f"{np.median(before):.2f} m → {np.median(after):.2f} m"),
    ]


def _share(distances: np.ndarray, limit: float) -> str:
    return f"{100 * np.mean(distances < limit):.1f} %"


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plain", type=Path, help="folder of gameinfer planning")
    parser.add_argument("safe", type=Path, help="folder of gameinfer planning --safety")
    options = parser.parse_args()
    plain, safe = read(options.plain), read(options.safe)
    common = [key for key in safe if key in plain]
    columns = {
        planner: lines(
            [plain[key] for key in common if key[0] == planner],
            [safe[key] for key in common if key[0] == planner],
        )
        for planner in (MAP, BASELINE)
    }
    print("| figure | robot aligned | robot baseline |\n|---|---|---|")
    for (name, aligned), (_, baseline) in zip(columns[MAP], columns[BASELINE], strict=True):
        print(f"| {name} | {aligned} | {baseline} |")


if __name__ == "__main__":
    main()
