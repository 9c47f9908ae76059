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

from gameinfer_ros import cli
from gameinfer_ros.experiments.report.command import CHAPTERS, Chapter
from gameinfer_ros.experiments.study.folder import StudyFolder
from gameinfer_ros.experiments.study.journal import Journal
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.scenario import Scenario

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
RESULTS = ROOT / "docs/results"
STUDIES = (ROOT / "docs/studies.md").read_text(encoding="utf-8")


def commands() -> list[str]:
    """Arguments of every `gameinfer` that a document shows."""
    found = []
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8")
        for block in re.findall(r"^```sh\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            found += re.findall(r"^\./dev exec gameinfer (.*)$", block, re.MULTILINE)
    return found


@pytest.mark.parametrize("command", commands())
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
    assert {command.split()[0] for command in commands()} == set(cli.COMMANDS)


@pytest.mark.parametrize("name", ["equilibria", "prediction", "planning", "report"])
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


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: f"{c.study.__name__}-{c.scenario}")
def test_the_shipped_figures_are_those_of_the_shipped_runs(chapter: Chapter) -> None:
    assert_alike(*figures_of(chapter))


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda c: f"{c.study.__name__}-{c.scenario}")
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
