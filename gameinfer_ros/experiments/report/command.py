"""Conducts all studies, and writes a page about them: the command `gameinfer report`."""

from __future__ import annotations

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

#: With fewer runs, chance decides some of the claims.
FEW = 100


class Chapter(NamedTuple):
    """A study of one scenario, what is claimed of it, and the option that says how many runs."""

    scenario: str
    study: type[Study]
    claims: Callable[[str, Mapping[str, Any]], list[Claim]]
    option: str


CHAPTERS = (
    Chapter("two_player", EquilibriaStudy, claims.of_equilibria, "--samples"),
    Chapter("three_player", EquilibriaStudy, claims.of_equilibria, "--samples"),
    Chapter("three_player", PredictionStudy, claims.of_prediction, "--runs"),
    Chapter("three_player", PlanningStudy, claims.of_planning, "--runs"),
    Chapter("five_player", PlanningStudy, claims.of_planning, "--runs"),
    Chapter("five_player_unicycle", PlanningStudy, claims.of_planning, "--runs"),
)


def run(options: argparse.Namespace) -> int:
    """Conduct all studies as the options say; returns the exit code."""

    def conduct(console: Console) -> dict[str, Any]:
        workers = command.make_workers(options)
        options.out = command.make_folder(options, "report")
        every: list[Claim] = []
        studies, sections = {}, []
        for chapter in CHAPTERS:
            study = chapter.study(command.load(chapter.scenario))
            name = f"{study.name}-{chapter.scenario}"
            runs = {"--samples": options.samples, "--runs": options.runs}[chapter.option]
            folder = options.out / name
            figures = command.complete(study, runs, folder, workers, options, console)
            studies[name] = figures
            every += chapter.claims(chapter.scenario, figures)
            alone = (
                f"gameinfer {study.name} --scenario {chapter.scenario} --seed {options.seed} "
                f"{chapter.option} {runs}"
            )
            calls = StudyFolder(folder, study).calls
            sections.append(page.Section(study, chapter.scenario, folder, figures, alone, calls))
        path = options.out / "report.html"
        few = options.runs if options.runs < FEW else None
        path.write_text(page.render(every, sections, few), encoding="utf-8")
        console.print(_table(every).in_terminal())
        if options.runs < FEW:
            console.print(f"With {options.runs} runs, chance decides some of these.")
        console.print(f"Report: {path.resolve()}", soft_wrap=True)
        return {"claims": [claim._asdict() for claim in every], "studies": studies}

    return command.guarded(conduct, options)


def _table(every: list[Claim]) -> Table:
    rows = [[c.claim, c.published, c.found, "yes" if c.holds else "no"] for c in every]
    return Table(
        "what is claimed, and whether it holds", ["claim", "published", "here", "holds"], rows
    )
