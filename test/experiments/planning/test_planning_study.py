"""The study of planning."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from forking import write_python
from ros_domain import free_domain

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments.planning import planning_study
from gameinfer_ros.experiments.planning.planning_study import PlanningStudy
from gameinfer_ros.experiments.planning.ros_run import run_on_ros
from gameinfer_ros.experiments.study import FailedRunError
from gameinfer_ros.names.choices import BASELINE, MAP
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario


def row(seed: int, planner: str, costs: tuple[float, float], distance: float) -> dict[str, str]:
    return {
        **{"seed": str(seed), "planner": planner, "smallest_distance": str(distance)},
        **{"cost_robot": str(costs[0]), "cost_human_1": str(costs[1])},
        **{"mean_step_ms": "1.0", "median_step_ms": "0.5", "max_step_ms": str(10 * seed)},
    }


def test_figures_are_those_of_the_rows(two_player: Scenario) -> None:
    rows = [
        row(0, MAP, (600.0, 610.0), 1.2), row(0, BASELINE, (900.0, 650.0), 0.4),
        row(1, MAP, (620.0, 590.0), 1.4), row(1, BASELINE, (1500.0, 700.0), 0.9),
    ]  # fmt: skip
    figures = PlanningStudy(two_player).figures(rows)
    assert list(figures) == [MAP, BASELINE]
    assert figures[MAP]["mean_cost"] == [610.0, 600.0]
    np.testing.assert_allclose(figures[MAP]["sem"], [10.0, 10.0])
    assert figures[BASELINE]["mean_cost"] == [1200.0, 675.0]
    assert figures[MAP]["smallest_distance"] == 1.2
    assert figures[BASELINE]["smallest_distance"] == 0.4
    assert figures[MAP]["collision_share"] == 0.0
    assert figures[BASELINE]["collision_share"] == 0.5
    assert figures[BASELINE]["paired_extra_cost"] == [590.0, 75.0]
    assert (figures[MAP]["step_ms"], figures[MAP]["max_step_ms"]) == (1.0, 10.0)
    json.dumps(figures, allow_nan=False)


def test_the_interval_of_the_difference_is_that_of_pairs(two_player: Scenario) -> None:
    # What runs cost differs a lot, but in every run the baseline pays 100 more.
    rows = [
        row(seed, planner, (1000.0 * seed + extra, 1.0), 1.0)
        for seed in range(5)
        for planner, extra in ((MAP, 0.0), (BASELINE, 100.0))
    ]
    figures = PlanningStudy(two_player).figures(rows)
    assert figures[BASELINE]["paired_extra_cost"][0] == 100.0
    assert figures[BASELINE]["paired_half_interval_95"][0] < 1e-9
    assert figures[BASELINE]["half_interval_95"][0] > 1000.0


def test_one_run_has_no_intervals_and_can_be_shown(two_player: Scenario) -> None:
    rows = [row(0, MAP, (600.0, 610.0), 1.2), row(0, BASELINE, (900.0, 650.0), 0.4)]
    study = PlanningStudy(two_player)
    figures = study.figures(rows)
    assert figures[MAP]["sem"] == [None, None]
    json.dumps(figures, allow_nan=False)
    costs, _ = study.tables(figures)
    assert costs.rows[0] == ["robot", "600", "900", "300"]
    study.draw(rows, figures)


def test_a_row_is_what_the_closed_loop_gives(short: Path) -> None:
    scenario = Scenario.load(short)
    made = PlanningStudy(scenario).play((4, MAP))
    record = closed_loop.run(scenario, MAP, 4)
    assert [made["cost_robot"], made["cost_human_1"]] == record.costs.tolist()
    assert made["smallest_distance"] == record.smallest_distance
    assert made["steps"] == 12
    assert 0 < float(made["median_step_ms"]) <= float(made["max_step_ms"])
    digests = {
        PlanningStudy(scenario).play(key)["trajectory_sha256"] for key in [(4, MAP), (5, MAP)]
    }
    assert len(digests) == 2 and made["trajectory_sha256"] in digests


def test_a_digest_sees_the_last_bit(short: Path) -> None:
    record = closed_loop.run(Scenario.load(short), BASELINE, 0)
    before = planning_study._digest(record)
    record.inputs[-1] = np.nextafter(record.inputs[-1], np.inf)
    assert planning_study._digest(record) != before


def test_a_time_that_was_not_measured_is_unknown(two_player: Scenario) -> None:
    rows = [
        row(0, planner, (1.0, 2.0), 1.0) | {"mean_step_ms": "nan"} for planner in (MAP, BASELINE)
    ]
    study = PlanningStudy(two_player)
    figures = study.figures(rows)
    assert figures[MAP]["step_ms"] is None
    assert study.tables(figures)[1].rows[0][4] == "unknown"


def test_the_figures_contain_what_a_safety_layer_did(two_player: Scenario) -> None:
    acts = [(0, 0), (2, 1), (0, 0), (4, 5)]
    rows = [
        row(seed, planner, (600.0, 610.0), 1.2)
        | {"safety_braked": str(acts[i][0]), "safety_limited": str(acts[i][1])}
        for i, (planner, seed) in enumerate([(MAP, 0), (MAP, 1), (BASELINE, 0), (BASELINE, 1)])
    ]
    study = PlanningStudy(two_player, safety=True)
    figures = study.figures(rows)
    assert figures[MAP]["safety_steps"] == {"braked": 1.0, "limited": 0.5}
    assert figures[BASELINE]["safety_steps"] == {"braked": 2.0, "limited": 2.5}
    assert figures[MAP]["safety_braked_share"] == 0.5
    assert study.tables(figures)[2].rows[0] == ["aligned", "50.0 %", "1.0", "0.5"]
    assert "safety_steps" not in PlanningStudy(two_player).figures(rows)[MAP]


def test_runs_with_and_without_a_safety_layer_do_not_mix(
    short: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    common = ["planning", "--scenario", str(short), "--runs", "1", "--jobs", "1"]
    plain, safe = ["--out", str(tmp_path / "plain")], ["--out", str(tmp_path / "safe")]
    assert cli.main([*common, *plain]) == 0
    assert cli.main([*common, *safe, "--safety"]) == 0
    for options in ([*plain, "--safety"], safe):
        assert cli.main([*common, *options]) == 2
        assert "made_by is 'core" in capfd.readouterr().err
    header = (tmp_path / "plain/runs.csv").read_text().splitlines()[0]
    assert "safety" not in header
    assert "safety_braked,safety_limited" in (tmp_path / "safe/runs.csv").read_text()
    described = json.loads((tmp_path / "plain/study.json").read_text())["scenario"]
    assert "safety" not in described and "limits" not in described["players"]["robot"]
    described = json.loads((tmp_path / "safe/study.json").read_text())["scenario"]
    assert described["safety"]["clearance"] == 0.5
    assert described["players"]["robot"]["limits"]["a"] == [-3.0, 3.0]


@pytest.mark.parametrize("safety", [[], ["--safety"]])
def test_on_ros_the_same_seeds_give_the_same_trajectories(
    safety: list[str],
    short: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))
    write_python(tmp_path / "python")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    common = ["planning", "--scenario", str(short), "--runs", "1", "--seed", "3", "--jobs", "1"]
    figures = {}
    for name, extra in (("core", []), ("ros", ["--ros"])):
        assert cli.main([*common, *safety, "--out", str(tmp_path / name), "--json", *extra]) == 0
        figures[name] = json.loads(capfd.readouterr().out)
    core, ros = tmp_path / "core/runs.csv", tmp_path / "ros/runs.csv"
    assert ros.read_bytes() == core.read_bytes()
    assert len(core.read_text().splitlines()) == 1 + 2
    for planner in (MAP, BASELINE):
        assert figures["ros"][planner]["mean_cost"] == figures["core"][planner]["mean_cost"]
        assert figures["ros"][planner]["step_ms"] > 0


def test_a_run_on_ros_that_fails_says_why(
    two_player: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "nonsense")
    with pytest.raises(FailedRunError, match=r"run 7 with planner map failed:\n.*ROS_DOMAIN_ID"):
        run_on_ros(two_player, MAP, 7)


def test_players_with_a_radius_collide_when_they_touch(two_player: Scenario) -> None:
    content = two_player.model_dump()
    content["players"]["human_1"]["radius"] = 0.25
    rows = [
        row(0, MAP, (600.0, 610.0), 0.4), row(0, BASELINE, (900.0, 650.0), -0.01),
    ]  # fmt: skip
    for scenario, shares, title in (
        (two_player, (1.0, 1.0), "collisions (below 0.5 m)"),
        (Scenario.model_validate(content), (0.0, 1.0), "collisions (below 0 m)"),
    ):
        study = PlanningStudy(scenario)
        figures = study.figures(rows)
        assert tuple(figures[name]["collision_share"] for name in (MAP, BASELINE)) == shares
        assert title in study.tables(figures)[1].title
