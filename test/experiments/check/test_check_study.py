"""The check of equilibria."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import OptimizeResult
from study_rows import rows_of

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments.check.check_study import CheckStudy
from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import Rows
from gameinfer_ros.scenario import Scenario


@pytest.fixture(scope="module")
def study(three_player: Scenario) -> CheckStudy:
    return CheckStudy(three_player)


@pytest.fixture(scope="module")
def rows(study: CheckStudy) -> Rows:
    return rows_of(study, [0, 1])


def test_a_sample_is_that_of_the_study_of_equilibria(study: CheckStudy, rows: Rows) -> None:
    same = EquilibriaStudy(study.scenario).play((1,))
    for column in ("status", "iterations", "smallest_distance"):
        assert rows[1][column] == str(same[column])
    for column in study.cost_columns:
        assert float(rows[1][column]) == pytest.approx(same[column], rel=1e-9)


def test_gaps_are_what_players_gain(study: CheckStudy, rows: Rows) -> None:
    for row in rows:
        for name in study.players:
            cost, best = float(row[f"cost_{name}"]), float(row[f"best_cost_{name}"])
            assert 0 <= best <= cost
            assert float(row[f"relative_gap_{name}"]) == pytest.approx(1 - best / cost)


def test_equilibria_are_within_the_tolerance(study: CheckStudy, rows: Rows) -> None:
    figures = study.figures(rows)
    assert study.holds(figures)
    assert (figures["samples"], figures["converged_share"]) == (2, 1.0)
    assert figures["median_iterations"] == np.mean([int(row["iterations"]) for row in rows])
    assert figures["collided"] == 0
    for name in study.players:
        gaps = [float(row[f"relative_gap_{name}"]) for row in rows]
        spread = figures["relative_gap"][name]
        assert spread["median"] == pytest.approx(np.mean(gaps))
        assert min(gaps) <= spread["percentile_95"] <= spread["largest"] == max(gaps) < 0.01
    strict = CheckStudy(study.scenario, tolerance=1e-6)
    assert not strict.holds(strict.figures(rows))


def test_one_player_s_gap_is_enough(study: CheckStudy, rows: Rows) -> None:
    changed = [dict(row) for row in rows]
    changed[1] |= {"relative_gap_human_1": "0.3", "smallest_distance": "0.4"}
    figures = study.figures(changed)
    assert figures["seeds_above_tolerance"] == [1]
    assert figures["above_tolerance"] == figures["above_tolerance_collided"] == 1
    assert figures["collided"] == 1
    assert not study.holds(figures)
    (table,) = study.tables(figures)
    assert "equilibria with a gap above 1 %: 1, of which collisions: 1" in table.title
    assert ["human_1", "30.00 %"] in [[row[0], row[3]] for row in table.rows]


def test_what_did_not_converge_is_not_checked(three_player: Scenario) -> None:
    solver = three_player.solver.model_copy(update={"max_iterations": 2})
    hasty = CheckStudy(three_player.model_copy(update={"solver": solver}))
    rows = rows_of(hasty, [0, 1])
    assert rows[0]["status"] == "iteration_limit"
    assert rows[0]["reason_robot"] == "not checked"
    figures = hasty.figures(rows)
    assert figures["converged_share"] == 0 and figures["median_iterations"] is None
    assert figures["relative_gap"]["robot"]["median"] is None
    assert not hasty.holds(figures)
    hasty.tables(figures)
    hasty.draw(rows, figures)


def aborted(cost_and_gradient: Any, start: np.ndarray, **options: Any) -> OptimizeResult:
    """A search that gives up where it begins."""
    cost, _ = cost_and_gradient(start)
    return OptimizeResult(x=start, fun=cost, status=2, message="ABNORMAL: ", nfev=1)


def test_searches_that_give_up_prove_no_equilibrium(
    study: CheckStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scipy.optimize.minimize", aborted)
    figures = study.figures(rows_of(study, [0, 1]))
    assert figures["above_tolerance"] == 0 and figures["converged_share"] == 1
    assert figures["searches"] == 6
    assert figures["gave_up"] == dict.fromkeys(study.players, 2)
    assert not study.holds(figures)
    (table,) = study.tables(figures)
    assert "6 of 6 searches gave up" in table.title
    assert table.header[-1] == "gave up"
    assert [row[-1] for row in table.rows] == ["2", "2", "2"]


def test_one_search_in_a_hundred_may_give_up(study: CheckStudy, rows: Rows) -> None:
    many = [dict(rows[k % 2]) for k in range(100)]  # 300 searches
    for k, player in enumerate(study.players):
        many[k][f"reason_{player}"] = "iteration limit"
    figures = study.figures(many)
    assert sum(figures["gave_up"].values()) == 3
    assert study.holds(figures)
    many[3]["reason_robot"] = "abnormal: "
    assert not study.holds(study.figures(many))


def test_curves_end_at_all_equilibria(study: CheckStudy, rows: Rows) -> None:
    figure = study.draw(rows, study.figures(rows))
    curves = [line for line in figure.axes[0].lines if line.get_label() in study.players]
    assert len(curves) == 3
    for line in curves:
        assert line.get_ydata()[-1] == 1.0
        assert np.all(np.diff(line.get_xdata()) >= 0)


def test_the_exit_code_tells_whether_all_are_equilibria(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["check", "--scenario", "two_player", "--samples", "2", "--jobs", "1", "--json"]
    folder = ["--out", str(tmp_path / "out")]
    assert cli.main([*command, *folder, "--tolerance", "0.9"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures["samples"], figures["tolerance"]) == (2, 0.9)
    # The runs are there already: only what they are compared with differs.
    runs = (tmp_path / "out/runs.csv").read_text()
    assert cli.main([*command, *folder, "--tolerance", "0"]) == 1
    assert json.loads(capsys.readouterr().out)["above_tolerance"] == 2
    assert (tmp_path / "out/runs.csv").read_text() == runs
    assert len(json.loads((tmp_path / "out/study.json").read_text())["calls"]) == 1


@pytest.mark.parametrize("share", ["-0.1", "1.1", "much", "nan"])
def test_a_tolerance_that_is_no_share_is_refused(
    share: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main(["check", "--tolerance", share])
    assert f"'{share}' is not allowed: it must be a number from 0 to 1" in capsys.readouterr().err
