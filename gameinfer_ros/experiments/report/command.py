"""The command `gameinfer report`: run all studies and write a page with their results."""

import argparse
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from rich.console import Console

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.planning.planning_study import PlanningStudy
from gameinfer_ros.experiments.prediction.prediction_study import PredictionStudy
from gameinfer_ros.experiments.report import claims, page
from gameinfer_ros.experiments.report.claims import Claim
from gameinfer_ros.experiments.study import Study, Table, command
from gameinfer_ros.experiments.study.folder import StudyFolder
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.runs.folder import REPORT, results_folder

#: With fewer runs than this, some claims hold or fail by chance.
FEW = 100


class Chapter(NamedTuple):
    """A study in the report."""

    scenario: str  # its name
    study: type[Study]
    claims: Callable[[str, Mapping[str, Any]], list[Claim]]  # by scenario and figures
    option: str  # the option with the number of runs


CHAPTERS = (
    Chapter("two_player", EquilibriaStudy, claims.of_equilibria, "--samples"),
    Chapter("three_player", EquilibriaStudy, claims.of_equilibria, "--samples"),
    Chapter("three_player", PredictionStudy, claims.of_prediction, "--runs"),
    Chapter("three_player", PlanningStudy, claims.of_planning, "--runs"),
    Chapter("five_player", PlanningStudy, claims.of_planning, "--runs"),
    Chapter("five_player_unicycle", PlanningStudy, claims.of_planning, "--runs"),
)


def run(options: argparse.Namespace) -> int:
    """Run all studies with the given options, write the page, and return the exit code."""

    def conduct(console: Console) -> tuple[dict[str, Any], bool]:
        workers = command.make_workers(options)
        with results_folder(
            options.out, REPORT, "report", overwrite=options.overwrite, resume=True
        ) as options.out:
            return _conduct(options, workers, console), True

    return command.guarded(conduct, options)


def _conduct(options: argparse.Namespace, workers: Workers, console: Console) -> dict[str, Any]:
    checked: list[Claim] = []
    studies, sections = {}, []
    for chapter in CHAPTERS:
        study = chapter.study(command.load(chapter.scenario))
        runs = {"--samples": options.samples, "--runs": options.runs}[chapter.option]
        folder = options.out / f"{study.name}-{chapter.scenario}"
        figures, _ = command.complete(study, runs, folder, workers, options, console)
        studies[folder.name] = figures
        checked += chapter.claims(chapter.scenario, figures)
        alone = (
            f"gameinfer {study.name} --scenario {chapter.scenario} --seed {options.seed} "
            f"{chapter.option} {runs}"
        )
        calls = StudyFolder(folder, study).calls
        sections.append(page.Section(study, chapter.scenario, folder, figures, alone, calls))
    path = options.out / "report.html"
    few = options.runs if options.runs < FEW else None
    path.write_text(page.render(checked, sections, few), encoding="utf-8")
    rows = [[c.claim, c.published, c.found, "yes" if c.holds else "no"] for c in checked]
    table = Table("claims", ["claim", "published", "here", "holds"], rows)
    console.print(table.in_terminal())
    if few is not None:
        console.print(f"With only {options.runs} runs, some claims hold or fail by chance.")
    console.print(f"Report: {path.resolve()}", soft_wrap=True)
    return {"claims": [claim._asdict() for claim in checked], "studies": studies}
