"""A campaign of faults against the running stack: what happens, and whether promises hold.

    ./dev exec python benchmarks/faults [--repetitions N] [--seed N] [--gap S] [--only WORDS]
        [--json FILE]

Nodes and orchestrators are killed, stopped and interrupted at random steps, messages are lost,
spoilt and far too many, clocks jump, disks are full, and nodes start in random order. Each trial is
watched, and checks all that is promised of a run. Exits with 1 if anything of that does not hold.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
from pathlib import Path
from typing import Any

from rich.console import Console

# The top folder too, because the tests have folders with the names of packages.
sys.path += [str(Path(__file__).parents[2] / folder) for folder in ("", "test/support")]

import clocks
import messages
import orchestrators
import processes
from report import show, worst
from trial import Fault

from gameinfer_ros.experiments import machine


def attempts(fault: Fault, options: argparse.Namespace) -> dict[str, Any]:
    """Try a fault some times: what held, and the worst figures."""
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


def main() -> None:
    """Run the campaign and print what it shows."""
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
    console, told = Console(width=180), {}
    every = processes.FAULTS | orchestrators.FAULTS | messages.faults(options.gap) | clocks.FAULTS
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
