"""What the commands of all studies share."""

import argparse
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from gameinfer_ros.experiments.study.folder import StudyFolder
from gameinfer_ros.experiments.study.journal import JournalError
from gameinfer_ros.experiments.study.study import FailedRunError, Study
from gameinfer_ros.experiments.study.workers import Workers, WorkersError

# A signal must not interrupt this import later; see `gameinfer_ros.system.load`.
from gameinfer_ros.games import evaluation as _evaluation  # noqa: F401
from gameinfer_ros.names.choices import DASK
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.names.text import json_text
from gameinfer_ros.runs.folder import STUDY, FolderError, results_folder
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.solver import GameSolver
from gameinfer_ros.system.interruption import one_interruption
from gameinfer_ros.system.output import make_console, print_json


class OptionError(ValueError):
    """Options are invalid together; the message names them."""


def make_workers(options: argparse.Namespace) -> Workers:
    """Create the workers that the options describe, or raise `OptionError`."""
    if (options.backend == DASK) != (options.scheduler is not None):
        raise OptionError(
            f"--backend {DASK} and --scheduler ADDRESS require each other: give both or neither"
        )
    if options.scheduler is not None and options.jobs is not None:
        raise OptionError(
            f"--jobs {options.jobs} is not allowed with --scheduler: each worker of a Dask cluster "
            "plays one run at a time"
        )
    return Workers(options.jobs, options.scheduler)


def load(name_or_file: str) -> Scenario:
    """Load a scenario, and set its solver to one thread, because runs share the cores.

    Prints the warnings about it.
    """
    scenario = Scenario.load(name_or_file)
    for warning in [*scenario.warnings, *scenario.late_goals()]:
        print(f"{name_or_file}: warning: {warning}", file=sys.stderr)
    solver = scenario.solver.model_copy(update={"threads": 1})
    return scenario.model_copy(update={"solver": solver})


def guarded(
    conduct: Callable[[Console], tuple[dict[str, Any], bool]], options: argparse.Namespace
) -> int:
    """Run the work of a command, print its figures or its error, and return the exit code.

    The work returns its figures and whether they hold; if not, the exit code is `FAILED`.
    """
    console = make_console(options.json)
    try:
        with one_interruption():
            console.print(LOADING)
            figures, holds = conduct(console)
    except (OptionError, ScenarioError, FolderError, JournalError, OSError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except (FailedRunError, WorkersError) as error:
        print(error, file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        console.print("Interrupted. All finished runs are kept.")
        if options.out is not None:
            console.print(
                f"To resume, repeat the command with --out {options.out}.", soft_wrap=True
            )
        return INTERRUPTED
    if options.json:
        print_json(figures)
    return DONE if holds else FAILED


def run(options: argparse.Namespace, runs: int, make_study: Callable[[Scenario], Study]) -> int:
    """Run a study with the given number of runs, and return the exit code."""

    def conduct(console: Console) -> tuple[dict[str, Any], bool]:
        workers = make_workers(options)
        study = make_study(load(options.scenario))
        figures, options.out = complete(study, runs, options.out, workers, options, console)
        for table in study.tables(figures):
            console.print(table.in_terminal())
        console.print(f"Results: {options.out.resolve()}", soft_wrap=True)
        return figures, study.holds(figures)

    return guarded(conduct, options)


def complete(
    study: Study,
    runs: int,
    out: Path | None,
    workers: Workers,
    options: argparse.Namespace,
    console: Console,
) -> tuple[dict[str, Any], Path]:
    """Play the runs that are missing in a folder, and draw the results.

    Returns:
        The figures, and the folder, which is a new one if `out` is None.
    """
    name = f"{study.name}-{Path(options.scenario).stem}" if out is None else ""
    with results_folder(out, STUDY, name, overwrite=options.overwrite, resume=True) as out:
        folder = StudyFolder(out, study)
        options.out = options.out or out  # if this is interrupted
        # Compile once before the workers start; they load the result from disk.
        GameSolver(study.scenario.game, study.scenario.solver).warm_up()
        seeds = range(options.seed, options.seed + runs)
        rows = folder.complete(seeds, workers, console, _invocation())
        figures = study.figures(rows)
        (out / "figures.json").write_text(json_text(figures, indent=2) + "\n")
        picture = study.draw(rows, figures)
        picture.savefig(out / f"{study.name}.png", dpi=110)
        # A date would make the files of equal pictures differ.
        picture.savefig(out / f"{study.name}.pdf", metadata={"CreationDate": None})
    return figures, out


def _invocation() -> str:
    """Return the command line of this process, without the folders of this machine."""
    program, *args = sys.argv
    words = [Path(program).name, *args]
    if "-m" in sys.orig_argv:
        words = ["python", *sys.orig_argv[sys.orig_argv.index("-m") :]]
    return shlex.join(map(_without_folder, words))


def _without_folder(word: str) -> str:
    """Reduce an absolute path, also behind `--option=`, to its last component."""
    # Results are published, and the folder contains everything that the path would lead to.
    option, equals, value = word.rpartition("=")
    path = Path(value)
    return f"{option}{equals}{path.name}" if path.is_absolute() else word
