"""The check of the suite of standard games."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments.check import suite
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.scenario import suite as suite_files

CHECK = ["check", "--suite", "--samples", "2", "--jobs", "1", "--json", "--out"]


@pytest.fixture
def games(two_player: Scenario, monkeypatch: pytest.MonkeyPatch) -> dict[str, Scenario]:
    """Two games instead of all; the second has hardly time to converge."""
    solver = two_player.solver.model_copy(update={"max_iterations": 2})
    hasty = two_player.model_copy(update={"solver": solver})
    games = {"first": two_player, "hasty": hasty}
    monkeypatch.setattr(suite, "games", lambda: games)
    return games


@pytest.mark.usefixtures("games")
def test_every_game_is_checked_in_a_folder_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert cli.main([*CHECK, str(out)]) == 1  # because one game does not converge
    output = capsys.readouterr()
    figures = json.loads(output.out)
    assert list(figures) == ["first", "hasty"]
    assert json.loads((out / "suite.json").read_text()) == figures
    assert (out / "suite.md").read_text().startswith("| game | N |")
    assert "first" in output.err and "hasty" in output.err
    for name in figures:
        assert json.loads((out / name / "figures.json").read_text()) == figures[name]
        assert (out / name / "check.png").is_file()
    # It resumes: nothing is played again.
    assert cli.main([*CHECK, str(out)]) == 1
    assert json.loads(capsys.readouterr().out) == figures
    for name in figures:
        assert len(json.loads((out / name / "study.json").read_text())["calls"]) == 1


def test_the_exit_code_is_0_if_all_games_pass(
    games: dict[str, Scenario], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    del games["hasty"]
    assert cli.main([*CHECK, str(tmp_path / "out"), "--tolerance", "0.9"]) == 0
    assert json.loads(capsys.readouterr().out)["first"]["tolerance"] == 0.9


def test_the_method_can_be_chosen(
    games: dict[str, Scenario], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    del games["hasty"]
    assert cli.main([*CHECK, str(tmp_path / "out"), "--method", "newton"]) == 0
    gaps = json.loads(capsys.readouterr().out)["first"]["relative_gap"].values()
    assert max(gap["largest"] for gap in gaps) < 1e-5
    scenario = Scenario.load(tmp_path / "out/first/scenario.yaml")
    assert scenario.solver.method == "newton"


@pytest.mark.usefixtures("games")
def test_a_folder_with_another_study_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "figures.json").write_text("{}")
    assert cli.main([*CHECK, str(tmp_path)]) == 2
    assert "contains a study, and a suite does not replace it" in capsys.readouterr().err


def test_the_suite_and_a_scenario_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main(["check", "--suite", "--scenario", "two_player"])
    assert "argument --scenario: not allowed with argument --suite" in capsys.readouterr().err


def test_the_suite_has_all_games_and_a_scenario_with_scaled_costs(three_player: Scenario) -> None:
    games = suite.games()
    scaled = {"three_player_x0.01": 0.01, "three_player": 1.0, "three_player_x100": 100.0}
    assert list(games) == [*suite_files(), *scaled]
    game = three_player.game
    rng = np.random.default_rng(0)
    x, u = rng.normal(size=(3, 12)), rng.normal(size=(2, 6))
    for name, factor in scaled.items():
        costs = games[name].game.costs(x, u)
        np.testing.assert_allclose(costs, factor * game.costs(x, u), rtol=1e-12)


def test_a_line_shows_the_player_with_the_largest_gap() -> None:
    figures = {
        "samples": 16,
        "converged_share": 0.5,
        "median_iterations": 12.0,
        "collided": 2,
        "above_tolerance": 3,
        "relative_gap": {
            "a": {"median": 0.01, "percentile_95": 0.5},
            "b": {"median": 0.02, "percentile_95": 0.4},
        },
    }
    none = {"median": None, "percentile_95": None}
    failed = figures | {"converged_share": 0.0, "relative_gap": {"a": none}}
    table = suite.table({"one": figures, "other": failed})
    assert table.rows == [
        ["one", "2", "50 %", "12", "2.00 %", "50.00 %", "25 %", "3"],
        ["other", "1", "0 %", *["unknown"] * 4, "0"],
    ]
    assert "| one | 2 | 50 % | 12 |" in table.in_markdown()
