"""The results of a run: files in a folder, and output in the terminal."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from gameinfer_ros.bags.label import lost_words
from gameinfer_ros.names.exit_codes import BAD_INPUT
from gameinfer_ros.names.text import json_text
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.runs import folder as results
from gameinfer_ros.runs.figures import print_figures
from gameinfer_ros.runs.record import RUN_JSON, RUN_NPZ, RunRecord
from gameinfer_ros.system.interruption import ignore_interrupts, raise_on_interrupt

#: The picture of a run, in the folder of its results.
PICTURE = "picture.png"


def make_folder(options: argparse.Namespace) -> Path:
    """Create the folder of a run with its subfolders, and remove older results from it."""
    scenario = Path(options.scenario).stem
    try:
        name = f"{scenario}-{options.planner}-{options.seed}"
        out = results.make_folder(options.out, name, "logs", "parameters")
        for name in (RUN_JSON, RUN_NPZ, PICTURE):
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise RunError(str(error), BAD_INPUT) from None
    return out


@contextmanager
def writing(out: Path) -> Iterator[None]:
    """Convert an `OSError` of writing to the folder of a run to a `RunError`."""
    try:
        yield
    except OSError as error:
        raise RunError(f"--out: {out} cannot be written: {error}") from error


def present(
    record: RunRecord,
    options: argparse.Namespace,
    out: Path,
    bag: BagRecorder | None,
    console: Console,
) -> None:
    """Write the results, and print a summary. Raises `RunError` if they cannot be written."""
    from gameinfer_ros.runs import picture  # slow to import: not before the run

    title = f"{Path(options.scenario).stem}, planner {options.planner}, seed {options.seed}"
    with writing(out):
        record.save(out)
        picture.draw(record, out / PICTURE, title)
    summary = record.summary()
    console.print(title)
    print_figures(record.game.players.names, summary, console)
    if record.safety_braked is not None:
        console.print(
            f"Steps in which the safety layer braked: {record.safety_braked}, "
            f"limited: {record.safety_limited}"
        )
    console.print(f"Results: {out.resolve()}", soft_wrap=True)
    if bag is not None:
        console.print(f"Bag: {options.record.resolve()}, {bag.messages} messages", soft_wrap=True)
        if bag.lost:
            console.print(f"The bag is incomplete: {lost_words(bag.lost)}", soft_wrap=True)
    if options.animation is not None:
        _animate(record, options.animation, title, console)
    if options.json:
        print(json_text(summary), flush=True)


def _animate(record: RunRecord, path: Path, title: str, console: Console) -> None:
    from gameinfer_ros.runs import animation  # slow to import, and rarely used

    raise_on_interrupt()
    try:
        animation.draw(record, path, title, console)
    except OSError as error:
        raise RunError(f"--animation: {path} cannot be written: {error}") from None
    finally:
        ignore_interrupts()
    console.print(f"Animation: {path.resolve()}", soft_wrap=True)
