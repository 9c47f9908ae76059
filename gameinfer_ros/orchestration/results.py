"""The results of a run: files in a folder, and output in the terminal."""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rich.console import Console

from gameinfer_ros.bags.label import lost_words
from gameinfer_ros.names.exit_codes import BAD_INPUT
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.runs.figures import print_figures
from gameinfer_ros.runs.folder import BAG, RUN, FolderError, contents, results_folder
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.system.interruption import ignore_interrupts, raise_on_interrupt
from gameinfer_ros.system.output import print_json

#: The picture of a run, in the folder of its results.
PICTURE = "picture.png"


@contextmanager
def folders(options: argparse.Namespace) -> Iterator[Path]:
    """Create and lock the folder of a run, and that of its bag; raises `RunError`."""
    name = f"{Path(options.scenario).stem}-{options.planner}-{options.seed}"
    with ExitStack() as locks:
        try:
            out = locks.enter_context(
                results_folder(options.out, RUN, name, overwrite=options.overwrite)
            )
            if options.record is not None and contents(options.record) == BAG:
                with results_folder(options.record, BAG, overwrite=True, option="--record"):
                    pass  # deletes the earlier bag
        except (FolderError, OSError) as error:
            raise RunError(str(error), BAD_INPUT) from None
        yield out


@contextmanager
def writing(out: Path) -> Iterator[None]:
    """Convert an `OSError` of writing to the folder of a run to a `RunError`."""
    try:
        yield
    except OSError as error:
        raise RunError(f"--out: {out} cannot be written: {error}") from error


def save(record: RunRecord, options: argparse.Namespace, out: Path) -> None:
    """Write the results. Raises `RunError` if they cannot be written."""
    from gameinfer_ros.runs import picture  # slow to import: not before the run

    with writing(out):
        record.save(out)
        picture.draw(record, out / PICTURE, _title(options))


def present(
    record: RunRecord,
    options: argparse.Namespace,
    out: Path,
    bag: BagRecorder | None,
    console: Console,
) -> None:
    """Print a summary, and draw the animation. Raises `RunError` if that cannot be written."""
    title, summary = _title(options), record.summary()
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
        print_json(summary)


def _title(options: argparse.Namespace) -> str:
    return f"{Path(options.scenario).stem}, planner {options.planner}, seed {options.seed}"


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
