"""Tells what a bag of a run holds; needs no ROS."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from gameinfer_ros.bags.label import lost_words
from gameinfer_ros.bags.run_bag import BagError, RunBag
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, INTERRUPTED
from gameinfer_ros.names.text import json_text
from gameinfer_ros.runs import animation

#: Figures of a run that was interrupted before it began.
_NO_STATES = {
    "cost": None,
    "smallest_distance": None,
    "steps": 0,
    "late_steps": 0,
    "missing_steps": 0,
    "map_probability": None,
    "safety_braked": None,
    "safety_limited": None,
}


def run(options: argparse.Namespace) -> int:
    """Print what the bag holds; returns the exit code."""
    console = Console(highlight=False, markup=False)
    try:
        bag = RunBag(options.bag)
        found = inspect(bag)
    except BagError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    _show(found, bag.scenario.game.players.names, console)
    if options.animation is not None:
        try:
            _animate(bag, options.animation, console)
        except (BagError, OSError) as error:
            print(f"--animation: {error}", file=sys.stderr)
            return BAD_INPUT
        except KeyboardInterrupt:
            console.print("Interrupted: there is no animation.")
            return INTERRUPTED
    if options.json:
        print(json_text(found), flush=True)
    return DONE


def inspect(bag: RunBag) -> dict[str, Any]:
    """The figures of a recorded run, fit for JSON.

    Raises:
        BagError: the bag is damaged, or not whole.
    """
    label, record = bag.label, bag.record()
    solve_ms = np.array(record.step_ms)
    return {
        "scenario": label.scenario,
        "planner": label.planner,
        "time": label.time,
        "seed": label.seed,
        "duration_s": bag.seconds,
        "finished": bag.finished,
        "runs": bag.runs,
        "lost": dict(sorted(label.lost.items())),
        "topics": dict(sorted(bag.counts.items())),
        **(record.summary() if record.states else _NO_STATES),
        "solve_ms": (
            {"median": float(np.median(solve_ms)), "longest": float(solve_ms.max())}
            if len(solve_ms)
            else None
        ),
    }


def _animate(bag: RunBag, path: Path, console: Console) -> None:
    """Draw the run as an animation.

    Raises:
        BagError: it was interrupted before it began.
        OSError: the file cannot be written.
    """
    record, label = bag.record(), bag.label
    if not record.states:
        raise BagError(f"{bag.folder}: holds no state that could be drawn")
    title = f"{label.scenario}, planner {label.planner}, seed {label.seed}"
    animation.draw(record, path, title, console)
    console.print(f"Animation: {path.resolve()}", soft_wrap=True)


def _show(found: dict[str, Any], players: tuple[str, ...], console: Console) -> None:
    console.print(
        f"{found['scenario']}, planner {found['planner']}, seed {found['seed']}, {found['time']}"
    )
    topics = Table("topic")
    topics.add_column("messages", justify="right")
    for name, count in found["topics"].items():
        topics.add_row(name, str(count))
    console.print(topics)
    console.print(f"Recorded within {found['duration_s']:.1f} s")
    if found["lost"]:
        console.print(f"Not whole: {lost_words(found['lost'])}", soft_wrap=True)
    if not found["finished"]:
        console.print("The recording was cut off, or goes on: this is what there is of it.")
    if found["runs"] > 1:
        console.print(f"The bag holds {found['runs']} runs: what follows is of the last.")
    if found["cost"] is None:
        console.print("The run was interrupted before it began.")
        return
    costs = Table("player")
    costs.add_column("cost", justify="right")
    for name, cost in zip(players, found["cost"], strict=True):
        costs.add_row(name, f"{cost:.1f}")
    console.print(costs)
    if found["smallest_distance"] is not None:
        console.print(f"Smallest distance: {found['smallest_distance']:.2f} m")
    console.print(f"Steps: {found['steps']}, of them late: {found['late_steps']}")
    if found["missing_steps"]:
        console.print(f"Steps whose state is missing: {found['missing_steps']}")
    if found["solve_ms"] is not None:
        console.print(
            f"Solved in {found['solve_ms']['median']:.2f} ms (median), "
            f"{found['solve_ms']['longest']:.2f} ms (longest)"
        )
