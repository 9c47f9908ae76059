"""The command `gameinfer check`, for one scenario or for the suite of standard games."""

import argparse
from typing import Any

from rich.console import Console

from gameinfer_ros.experiments.check import suite
from gameinfer_ros.experiments.check.check_study import CheckStudy
from gameinfer_ros.experiments.study import command
from gameinfer_ros.names.text import json_text
from gameinfer_ros.runs.folder import SUITE, results_folder
from gameinfer_ros.scenario import Scenario


def run(options: argparse.Namespace) -> int:
    """Run the check that the options describe, and return the exit code."""
    if options.suite:
        return command.guarded(lambda console: _check_suite(options, console), options)
    return command.run(options, options.samples, lambda scenario: _make_study(scenario, options))


def _make_study(scenario: Scenario, options: argparse.Namespace) -> CheckStudy:
    if options.method:
        solver = scenario.solver.model_copy(update={"method": options.method})
        scenario = scenario.model_copy(update={"solver": solver})
    return CheckStudy(scenario, options.tolerance)


def _check_suite(options: argparse.Namespace, console: Console) -> tuple[dict[str, Any], bool]:
    """Check each game of the suite in a folder of its own; returns the figures of all by game."""
    workers = command.make_workers(options)
    studies = {name: _make_study(scenario, options) for name, scenario in suite.games().items()}
    figures = {}
    with results_folder(
        options.out, SUITE, "check-suite", overwrite=options.overwrite, resume=True
    ) as options.out:
        for name, study in studies.items():
            folder = options.out / name
            figures[name], _ = command.complete(
                study, options.samples, folder, workers, options, console
            )
        table = suite.table(figures)
        (options.out / "suite.json").write_text(json_text(figures, indent=2) + "\n")
        (options.out / "suite.md").write_text(table.in_markdown())
    console.print(table.in_terminal())
    console.print(f"Results: {options.out.resolve()}", soft_wrap=True)
    return figures, all(study.holds(figures[name]) for name, study in studies.items())
