"""The command `gameinfer inspect`: prints the contents of a bag, without ROS."""

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
from gameinfer_ros.runs.figures import print_figures
from gameinfer_ros.system.output import make_console, print_json

#: Figures of a run that was interrupted before its first state.
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
    """Print the contents of a bag, and return the exit code."""
    console = make_console(options.json)
    try:
        bag = RunBag(options.bag)
        found = inspect(bag)
    except BagError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    _show(found, bag, console)
    if options.animation is not None:
        try:
            _animate(bag, options.animation, console)
        except (BagError, OSError) as error:
            print(f"--animation: {error}", file=sys.stderr)
            return BAD_INPUT
        except KeyboardInterrupt:
            console.print("Interrupted: the animation was not written.")
            return INTERRUPTED
    if options.json:
        print_json(found)
    return DONE


def inspect(bag: RunBag) -> dict[str, Any]:
    """Return the figures of a recorded run, as an object for JSON; raises `BagError`."""
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
    from gameinfer_ros.runs import animation  # slow to import, and rarely used

    record = bag.record()
    if not record.states:
        raise BagError(f"{bag.folder}: contains no states to draw")
    animation.draw(record, path, bag.label.title, console)
    console.print(f"Animation: {path.resolve()}", soft_wrap=True)


def _show(found: dict[str, Any], bag: RunBag, console: Console) -> None:
    console.print(f"{bag.label.title}, {found['time']}")
    topics = Table("topic")
    topics.add_column("messages", justify="right")
    for name, count in found["topics"].items():
        topics.add_row(name, str(count))
    console.print(topics)
    console.print(f"Duration: {found['duration_s']:.1f} s")
    if found["lost"]:
        console.print(f"The bag is incomplete: {lost_words(found['lost'])}", soft_wrap=True)
    if not found["finished"]:
        console.print(
            "The recording was cut off or is still running; this is what has been written."
        )
    if found["runs"] > 1:
        console.print(f"The bag contains {found['runs']} runs; this is the last one.")
    if found["cost"] is None:
        console.print("The run was interrupted before its first state.")
        return
    print_figures(bag.scenario.game.players.names, found, console)
    if found["solve_ms"] is not None:
        console.print(
            f"Solved in {found['solve_ms']['median']:.2f} ms (median), "
            f"{found['solve_ms']['longest']:.2f} ms (longest)"
        )
