"""What docs/ says is so."""

from __future__ import annotations

import html
import importlib
import json
import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extreme_games import CLASSES
from pages import ROOT, shell_commands

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments.check import suite
from gameinfer_ros.experiments.check.check_study import MOST_GAVE_UP, CheckStudy
from gameinfer_ros.experiments.report.command import CHAPTERS, Chapter
from gameinfer_ros.experiments.study.folder import StudyFolder
from gameinfer_ros.experiments.study.journal import Journal
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.scenario import Scenario

RESULTS = ROOT / "docs/results"
STUDIES = (ROOT / "docs/studies.md").read_text(encoding="utf-8")
ROBUSTNESS = (ROOT / "docs/robustness.md").read_text(encoding="utf-8")

#: All studies whose results are shipped: those of the report, and the checks.
SHIPPED = (
    *CHAPTERS,
    *(
        Chapter(scenario, CheckStudy, lambda scenario, figures: [], "--samples")
        for scenario in ("two_player", "three_player", "five_player", "five_player_unicycle")
    ),
)


#: Arguments of every `gameinfer` that a page shows.
COMMANDS = [
    command.removeprefix("./dev exec gameinfer ")
    for command in shell_commands()
    if command.startswith("./dev exec gameinfer ")
]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_is_shown_is_understood(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    args = shlex.split(command, comments=True)
    module = importlib.import_module(f"gameinfer_ros.{cli.COMMANDS[args[0]][0]}")
    called = []
    monkeypatch.setattr(module, "run", lambda options: called.append(options) or 0)
    if "--help" in args:
        with pytest.raises(SystemExit, match="0"):
            cli.main(args)
    else:
        assert cli.main(args) == 0
        assert called


def test_there_are_commands() -> None:
    assert {command.split()[0] for command in COMMANDS} == set(cli.COMMANDS)


@pytest.mark.parametrize("name", ["equilibria", "check", "prediction", "planning", "report"])
def test_every_option_of_the_studies_is_named(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main([name, "--help"])
    options = set(re.findall(r"--[a-z-]+", capsys.readouterr().out)) - {"--help"}
    assert "--jobs" in options
    for option in options:
        assert re.search(rf"^\| `[^|]*{option}\b", STUDIES, re.MULTILINE), option


def figures_of(chapter: Chapter) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Figures that the shipped runs give, and those that are shipped."""
    study = chapter.study(Scenario.load(chapter.scenario))
    folder = RESULTS / f"{study.name}-{chapter.scenario}"
    rows: dict[Any, dict[str, str]] = {}
    for file, columns in (("times.csv", study.time_columns), ("runs.csv", study.columns)):
        if (folder / file).exists():
            for key, row in Journal(folder / file, study.key_columns, columns).rows.items():
                rows[key] = {**rows.get(key, {}), **row}
    return study.figures(list(rows.values())), json.loads((folder / "figures.json").read_text())


def assert_alike(found: Any, wanted: Any) -> None:
    """Check that figures are the same, to the rounding of sums."""
    if isinstance(wanted, dict):
        assert list(found) == list(wanted)
        for key in wanted:
            assert_alike(found[key], wanted[key])
    elif isinstance(wanted, list):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted, strict=True):
            assert_alike(one, other)
    elif isinstance(wanted, float):
        np.testing.assert_allclose(found, wanted, rtol=1e-9)
    else:
        assert found == wanted


@pytest.mark.parametrize("chapter", SHIPPED, ids=lambda c: f"{c.study.__name__}-{c.scenario}")
def test_the_shipped_figures_are_those_of_the_shipped_runs(chapter: Chapter) -> None:
    assert_alike(*figures_of(chapter))


@pytest.mark.parametrize("chapter", SHIPPED, ids=lambda c: f"{c.study.__name__}-{c.scenario}")
def test_the_shipped_runs_are_of_the_scenarios_there_are(chapter: Chapter, tmp_path: Path) -> None:
    study = chapter.study(Scenario.load(chapter.scenario))
    folder = tmp_path / "results"
    folder.mkdir()
    shipped = RESULTS / f"{study.name}-{chapter.scenario}" / "study.json"
    (folder / "study.json").write_text(shipped.read_text())
    StudyFolder(folder, study)  # refuses another scenario


def test_a_shipped_run_is_what_the_code_does() -> None:
    """The cheapest of them; on another processor, the last bits may lead elsewhere."""
    (chapter,) = [c for c in CHAPTERS if c.scenario == "two_player"]
    study = chapter.study(Scenario.load(chapter.scenario))
    folder = RESULTS / f"{study.name}-{chapter.scenario}"
    rows = Journal(folder / "runs.csv", study.key_columns, study.columns).rows
    costs = study.cost_columns
    agree = 0
    for seed in range(20):
        made, row = study.play((seed,)), rows[(seed,)]
        agree += all(abs(float(made[c]) - float(row[c])) < 1.0 for c in costs)
    assert agree >= 18


def test_the_shipped_claims_are_those_of_the_shipped_figures() -> None:
    page = html.unescape((RESULTS / "report.html").read_text(encoding="utf-8"))
    for chapter in CHAPTERS:
        figures, _ = figures_of(chapter)
        for claim in chapter.claims(chapter.scenario, figures):
            assert f"<td>{claim.claim}</td>" in page
            assert f"<td>{claim.found}</td>" in page
            assert claim.holds


@pytest.mark.parametrize(
    ("row", "study", "planner"),
    [
        (f"{players}, {word}", f"planning-{scenario}", planner)
        for players, scenario in (
            ("3 players", "three_player"),
            ("5 unicycles", "five_player_unicycle"),
            ("5 flat players", "five_player"),
        )
        for word, planner in (("aligned", "map"), ("baseline", "baseline"))
    ],
)
def test_the_table_says_what_was_found(row: str, study: str, planner: str) -> None:
    figures = json.loads((RESULTS / study / "figures.json").read_text())[planner]
    (line,) = re.findall(rf"^\| {row} \| (.*) \|$", STUDIES, re.MULTILINE)
    cells = [cell.strip() for cell in line.split("|")]
    costs = [
        f"{mean:.0f} ± {half:.0f}"
        for mean, half in zip(figures["mean_cost"], figures["half_interval_95"], strict=True)
    ]
    assert [cell for cell in cells[:-1] if cell] == costs
    assert cells[-1] == f"{100 * figures['collision_share']:.1f} %"


def test_the_patience_is_as_documented() -> None:
    assert Workers.DEATHS == 3 and Workers.LONGEST == 600  # as docs/studies.md says in words
    assert "three times in a row" in STUDIES and "ten minutes" in STUDIES


@pytest.mark.parametrize(
    ("row", "scenario"),
    [
        ("2 players", "two_player"),
        ("3 players", "three_player"),
        ("5 flat players", "five_player"),
        ("5 unicycles", "five_player_unicycle"),
        ("2 players, tight", "two_player_tight"),
        ("3 players, tight", "three_player_tight"),
    ],
)
def test_the_table_of_gaps_says_what_was_found(row: str, scenario: str) -> None:
    figures = json.loads((RESULTS / f"check-{scenario}/figures.json").read_text())
    (line,) = re.findall(rf"^\| {row} \| (.*) \|$", ROBUSTNESS, re.MULTILINE)
    gaps = figures["relative_gap"].values()

    def worst(key: str) -> str:
        return f"{100 * max(gap[key] for gap in gaps):.2f} %"

    above, collided = figures["above_tolerance"], figures["above_tolerance_collided"]
    assert [cell.strip() for cell in line.split("|")] == [
        f"{100 * figures['converged_share']:.1f} %",
        *(worst(key) for key in ("median", "percentile_95", "largest")),
        str(above),
        str(collided),
    ]


@pytest.mark.parametrize("folder", ["check-suite", "check-suite-newton"])
def test_the_tables_of_the_suite_say_what_was_found(folder: str) -> None:
    figures = json.loads((RESULTS / folder / "suite.json").read_text())
    assert set(suite.games()) == set(figures)
    for row in suite.table(figures).rows:
        assert f"| {' | '.join(row)} |\n" in ROBUSTNESS


def test_the_searches_behind_the_table_of_gaps_are_as_told() -> None:
    found = [json.loads(file.read_text()) for file in RESULTS.glob("check-*/figures.json")]
    searches = sum(figures["searches"] for figures in found)
    gave_up = sum(sum(figures["gave_up"].values()) for figures in found)
    assert gave_up == 0
    assert f"Of the {searches} searches behind this table, none gave up." in ROBUSTNESS
    assert f"At most {100 * MOST_GAVE_UP:.0f} % of the searches gave up" in ROBUSTNESS


def test_the_table_of_classes_says_what_was_found() -> None:
    found = json.loads((RESULTS / "robustness.json").read_text())["classes"]
    assert list(found) == list(CLASSES)
    for name, figures in found.items():
        shares = (figures[key] for key in (
            "converged", "iteration_limit", "line_search_failed", "not_finite"
        ))  # fmt: skip
        cells = " | ".join(f"{100 * share:.1f} %" for share in shares)
        assert f"| {name} | {CLASSES[name]} | {cells} |" in ROBUSTNESS
        assert figures["not_finite_unmarked"] == figures["games_with_changed_neighbours"] == 0
