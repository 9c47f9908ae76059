"""What the commands of all studies have in common."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console

from gameinfer_ros.experiments.study.folder import FolderError, StudyFolder
from gameinfer_ros.experiments.study.journal import JournalError
from gameinfer_ros.experiments.study.study import FailedRunError, Study
from gameinfer_ros.experiments.study.workers import Workers, WorkersError
from gameinfer_ros.names.choices import DASK
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.names.text import json_text
from gameinfer_ros.runs import folder as results
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.solver import IterativeLQ
from gameinfer_ros.system.interruption import one_interruption


class OptionError(ValueError):
    """Options contradict one another; the message names them."""


def make_workers(options: argparse.Namespace) -> Workers:
    """Who makes the runs.

    Raises:
        OptionError: the options contradict one another.
    """
    if (options.backend == DASK) != (options.scheduler is not None):
        raise OptionError(
            f"--backend {DASK} and --scheduler ADDRESS belong together: give both or neither"
        )
    if options.scheduler is not None and options.jobs is not None:
        raise OptionError("--jobs is for this machine: on a Dask cluster, each worker makes a run")
    return Workers(options.jobs, options.scheduler)


def make_folder(options: argparse.Namespace, name: str) -> Path:
    """Make the folder that results go to.

    Raises:
        OptionError: it cannot be made.
    """
    try:
        return results.make_folder(options.out, name)
    except OSError as error:
        raise OptionError(f"--out: {options.out} cannot be made: {error}") from None


def load(name_or_file: str) -> Scenario:
    """The scenario to play, with one thread for each run: runs share the cores.

    Raises:
        ScenarioError: it cannot be used.
    """
    scenario = Scenario.load(name_or_file)
    solver = scenario.solver.model_copy(update={"threads": 1})
    return scenario.model_copy(update={"solver": solver})


def guarded(conduct: Callable[[Console], dict[str, Any]], options: argparse.Namespace) -> int:
    """Do the work of a command and print what comes of it; returns the exit code."""
    console = Console(highlight=False, markup=False)
    try:
        with one_interruption():
            console.print(LOADING)
            figures = conduct(console)
    except (OptionError, ScenarioError, FolderError, JournalError, OSError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except (FailedRunError, WorkersError) as error:
        print(error, file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        console.print("Interrupted. The runs that have ended are kept.")
        if options.out is not None:
            console.print(
                f"The same command with --out {options.out} goes on with the others.",
                soft_wrap=True,
            )
        return INTERRUPTED
    if options.json:
        print(json_text(figures), flush=True)
    return DONE


def run(options: argparse.Namespace, runs: int, make_study: Callable[[Scenario], Study]) -> int:
    """Conduct a study of so many runs as the options say; returns the exit code."""
    holds = True

    def conduct(console: Console) -> dict[str, Any]:
        workers = make_workers(options)
        study = make_study(load(options.scenario))
        name = f"{study.name}-{Path(options.scenario).stem}"
        options.out = make_folder(options, name)
        figures = complete(study, runs, options.out, workers, options, console)
        for table in study.tables(figures):
            console.print(table.in_terminal())
        console.print(f"Results: {options.out.resolve()}", soft_wrap=True)
        nonlocal holds
        holds = study.holds(figures)
        return figures

    return guarded(conduct, options) or (DONE if holds else FAILED)


def complete(
    study: Study,
    runs: int,
    out: Path,
    workers: Workers,
    options: argparse.Namespace,
    console: Console,
) -> dict[str, Any]:
    """Make the runs that are missing in a folder, draw the results, and return the figures."""
    folder = StudyFolder(out, study)
    # Whoever compiles first does it for all, who load it from the disk.
    IterativeLQ(study.scenario.game, study.scenario.solver).warm_up()
    seeds = range(options.seed, options.seed + runs)
    rows = folder.complete(seeds, workers, console, _invocation())
    figures = study.figures(rows)
    (out / "figures.json").write_text(json_text(figures, indent=2) + "\n")
    save(study.draw(rows, figures), out / study.name)
    return figures


def save(figure: Figure, path: Path) -> None:
    """Write a picture as PNG and as PDF; `path` has no suffix."""
    figure.savefig(path.with_suffix(".png"), dpi=110)
    # Without a date, the same picture is the same file.
    figure.savefig(path.with_suffix(".pdf"), metadata={"CreationDate": None})


def _invocation() -> str:
    """The command line that this process was started with, without the folders of this machine."""
    program, *args = sys.argv
    words = [Path(program).name, *args]
    if "-m" in sys.orig_argv:
        words = ["python", *sys.orig_argv[sys.orig_argv.index("-m") :]]
    return shlex.join(map(_without_folder, words))


def _without_folder(word: str) -> str:
    """The word of a command line; of an absolute path, its last name only."""
    # The results lie in the folder and hold the scenario: nobody else has need of where they were.
    option, equals, value = word.rpartition("=")
    path = Path(value)
    return f"{option}{equals}{path.name}" if path.is_absolute() else word
