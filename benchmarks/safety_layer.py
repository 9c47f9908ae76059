"""What a safety layer changes: two folders of the study of planning, compared run by run.

The first is made by `gameinfer planning`, the second by `gameinfer planning --safety`, of the same
scenario. Runs that are in both count.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from gameinfer_ros.experiments.planning.planning_study import COLLISION
from gameinfer_ros.experiments.study import numbers, statistics
from gameinfer_ros.experiments.study.folder import RUNS
from gameinfer_ros.names.choices import BASELINE, MAP

Run = dict[str, str]


def read(folder: Path) -> dict[tuple[str, str], Run]:
    """The runs of a folder, by planner and seed."""
    with (folder / RUNS).open(newline="", encoding="utf-8") as file:
        return {(run["planner"], run["seed"]): run for run in csv.DictReader(file)}


def lines(plain: list[Run], safe: list[Run]) -> list[tuple[str, str]]:
    """What the layer changes in the runs with one planner: a name and a value for each figure."""
    costs = [name for name in plain[0] if name.startswith("cost_")]
    more = numbers(safe, costs) - numbers(plain, costs)
    half = statistics.half_interval(more)
    braked, limited = numbers(safe, ["safety_braked", "safety_limited"]).T
    before, after = (numbers(runs, ["smallest_distance"])[:, 0] for runs in (plain, safe))
    same = [
        a["trajectory_sha256"] == b["trajectory_sha256"] for a, b in zip(plain, safe, strict=True)
    ]
    return [
        ("runs", f"{len(safe)}"),
        ("runs that are the same to the last bit", f"{sum(same)}"),
        ("runs in which it braked", f"{np.count_nonzero(braked)}"),
        ("steps braked, a run", f"{braked.mean():.1f}"),
        ("steps limited, a run", f"{limited.mean():.1f}"),
        *(
            (f"more cost to {name[5:]}, a run", f"{round(mean):+d} ± {interval:.0f}")
            for name, mean, interval in zip(costs, more.mean(axis=0), half, strict=True)
        ),
        (f"runs under {COLLISION} m", f"{_share(before, COLLISION)} → {_share(after, COLLISION)}"),
        ("runs under 0.3 m", f"{_share(before, 0.3)} → {_share(after, 0.3)}"),
        ("smallest distance", f"{before.min():.2f} m → {after.min():.2f} m"),
        ("median smallest distance", f"{np.median(before):.2f} m → {np.median(after):.2f} m"),
    ]


def _share(distances: np.ndarray, limit: float) -> str:
    return f"{100 * np.mean(distances < limit):.1f} %"


def main() -> None:
    """Print the comparison as a table in Markdown."""
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
