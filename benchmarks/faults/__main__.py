"""A campaign that injects faults into the running stack and checks its guarantees.

    ./dev exec python benchmarks/faults [--repetitions N] [--seed N] [--gap S] [--only WORDS]
        [--json FILE]

Nodes are killed and stopped and runs interrupted at random moments, messages are lost, spoilt and
far too many, clocks jump, and nodes start in random order. Each trial is watched, and checks where
each input of the robot comes from. Exits with 1 if anything that is promised does not hold.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import tempfile
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

# The top folder too, because the tests have folders with the names of packages.
sys.path += [str(Path(__file__).parents[2] / folder) for folder in ("", "test/support")]

import clocks
import messages
import processes
from trial import Fault

from gameinfer_ros.experiments import machine

#: Figures of promises, by what they are called in the table.
PROMISES = {
    "oldest state, steps": "oldest_state_steps",
    "oldest strategy, steps": "oldest_strategy_steps",
    "brakes within, steps": "brake_steps",
    "goes on after, s": "resume_s",
    "belief after, steps": "rebuild_steps",
}

#: Figures of which the lowest is the worst.
_LOWEST = ("slowest_m_s", "messages_per_s", "judged_inputs")


def attempts(fault: Fault, options: argparse.Namespace) -> dict[str, Any]:
    """Repeat a fault; return how often all guarantees held, and the worst figures."""
    broken, figures = [], []
    for _ in range(options.repetitions):
        with tempfile.TemporaryDirectory() as folder:
            try:
                figures.append(fault(Path(folder)))
            except Exception as error:  # of a promise, a deadline, or a bag that cannot be read
                broken.append(f"{type(error).__name__}: {error}")
    return {
        "trials": options.repetitions,
        "held": len(figures),
        "broken": broken,
        "worst": worst(figures),
    }


def worst(figures: list[dict[str, float]]) -> dict[str, float]:
    """Return the worst figure of all trials; not every trial has every figure."""
    names = {name: None for trial in figures for name in trial}
    return {
        name: (min if name in _LOWEST else max)(trial[name] for trial in figures if name in trial)
        for name in names
    }


def show(told: dict[str, Any], console: Console) -> None:
    """Print all figures as one table, and then the broken guarantees."""
    table = Table("fault", "held", *PROMISES, "other figures")
    for name, row in told.items():
        figures = dict(row["worst"])
        promised = [figures.pop(key, None) for key in PROMISES.values()]
        others = ", ".join(f"{key} {value:.3g}" for key, value in figures.items())
        cells = ["" if value is None else f"{value:.3g}" for value in promised]
        table.add_row(name, f"{row['held']} of {row['trials']}", *cells, others)
    console.print(table)
    for name, row in told.items():
        for what in row["broken"]:
            console.print(f"{name}: {what}", markup=False)


def main() -> None:
    """Run the campaign and print its results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=3, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    parser.add_argument(
        "--gap", type=float, default=5.0, metavar="S",
        help="time between the starts of two nodes, in s",
    )  # fmt: skip
    parser.add_argument("--only", default="", metavar="WORDS", help="faults with these words")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures here too")
    options = parser.parse_args()
    if options.repetitions < 1:
        parser.error(f"--repetitions: {options.repetitions} is not at least 1")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    console, told = Console(width=180), {}
    every = processes.FAULTS | messages.faults(options.gap) | clocks.FAULTS
    chosen = {name: fault for name, fault in every.items() if options.only in name}
    if not chosen:
        parser.error(f"--only: '{options.only}' is in the name of no fault: {', '.join(every)}")
    if clocks.LIBRARY is None:
        console.print("The time of day does not jump: Debian's package faketime is not installed.")
    for name, fault in chosen.items():
        random.seed(f"{options.seed} {name}")  # whichever others are chosen
        told[name] = attempts(fault, options)
        console.print(f"{name}: {told[name]['held']} of {options.repetitions}")
        console.file.flush()
        if options.json:  # as far as it has come
            figures = {"machine": machine.describe(), "seed": options.seed, "faults": told}
            options.json.write_text(json.dumps(figures, indent=2) + "\n")
    show(told, console)
    if any(row["broken"] for row in told.values()):
        sys.exit(1)


if __name__ == "__main__":
    main()
