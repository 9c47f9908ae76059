"""The report: a small version of every study, and the direction of each effect."""

from __future__ import annotations

import html
import io
import json
import re
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments.report import claims, published
from gameinfer_ros.experiments.report.command import CHAPTERS
from gameinfer_ros.experiments.study import command
from gameinfer_ros.names.choices import BASELINE, MAP
from gameinfer_ros.scenario import Scenario

#: As few as show every effect clearly.
RUNS, PARTICLES = "2", 50
OPTIONS = ["--runs", RUNS, "--samples", "96", "--jobs", "1"]
PLANNING = ["planning-three_player", "planning-five_player", "planning-five_player_unicycle"]


class Report(NamedTuple):
    folder: Path
    figures: dict[str, Any]
    told: str  # on stderr


@pytest.fixture(scope="module")
def few_particles() -> Iterator[None]:
    """Among five players, a robot that aligns has fewer particles than usual."""

    def load(name: str) -> Scenario:
        scenario = usual(name)
        inference = scenario.inference
        few = inference.model_copy(update={"particles": min(PARTICLES, inference.particles)})
        return scenario.model_copy(update={"inference": few})

    usual = command.load
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "load", load)
        yield


@pytest.fixture(scope="module")
def report(few_particles: None, tmp_path_factory: pytest.TempPathFactory) -> Report:
    folder = tmp_path_factory.mktemp("report")
    out, told = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(told):
        code = cli.main(["report", *OPTIONS, "--out", str(folder), "--json"])
    assert code == 0
    return Report(folder, json.loads(out.getvalue()), told.getvalue())


def test_the_object_is_alone_on_stdout(report: Report) -> None:
    """Otherwise, the fixture could not have read it."""
    assert set(report.figures) == {"claims", "studies"}
    for words in ("Loading compiled code", "claims", f"Report: {report.folder}/report.html"):
        assert words in report.told


def test_games_have_the_published_number_of_equilibria(report: Report) -> None:
    for scenario, count in published.CLUSTERS.items():
        figures = report.figures["studies"][f"equilibria-{scenario}"]
        assert len(figures["clusters"]) == count
        assert figures["samples"] == 96
        assert figures["collided"] + figures["not_converged"] <= 6


def test_inference_predicts_better(report: Report) -> None:
    figures = report.figures["studies"]["prediction-three_player"]
    inference, baseline = figures["inference"], figures["baseline"]
    assert inference["peak"] < 0.5 * baseline["peak"]
    assert 4 < baseline["peak_look_ahead_s"] < 7
    after = np.array(inference["time_s"]) > 2
    by_time = {name: np.array(f["mean_squared_error_by_time"]) for name, f in figures.items()}
    assert by_time["inference"][after].max() < 0.1 * by_time["baseline"][after].max()


@pytest.mark.parametrize("name", PLANNING)
def test_alignment_pays(name: str, report: Report) -> None:
    figures = report.figures["studies"][name]
    aligned, baseline = (np.array(figures[planner]["mean_cost"]) for planner in (MAP, BASELINE))
    assert aligned[0] < 0.8 * baseline[0]
    assert aligned[1:].mean() < 0.95 * baseline[1:].mean()
    # Of those who pay for it, the robot pays most.
    assert baseline[0] - aligned[0] > (baseline - aligned)[1:].max()
    assert figures[MAP]["collision_share"] < figures[BASELINE]["collision_share"]
    assert figures[MAP]["median_smallest_distance"] > figures[BASELINE]["median_smallest_distance"]


def test_among_three_alignment_pays_for_all_players(report: Report) -> None:
    figures = report.figures["studies"]["planning-three_player"]
    aligned, baseline = (np.array(figures[planner]["mean_cost"]) for planner in (MAP, BASELINE))
    assert ((aligned > 630) & (aligned < 750)).all()
    assert (baseline > aligned + 50).all()


def test_the_page_needs_nothing_else(report: Report) -> None:
    page = (report.folder / "report.html").read_text()
    sources = re.findall(r'(?:src|href)\s*=\s*"([^"]{0,30})', page)
    assert len(sources) == len(CHAPTERS)
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert "url(" not in page and "@import" not in page and "<script" not in page


def test_the_page_says_what_was_found_and_how(report: Report) -> None:
    page = html.unescape((report.folder / "report.html").read_text())
    for claim in report.figures["claims"]:
        assert claim["claim"] in page and claim["found"] in page
    costs = report.figures["studies"]["planning-three_player"][MAP]["mean_cost"]
    assert all(f"<td>{cost:.0f}</td>" in page for cost in costs)
    assert all(f"<td>{cost}</td>" in page for cost in published.MEAN_COSTS["three_player"][MAP])
    assert f"gameinfer planning --scenario five_player --seed 0 --runs {RUNS}" in page
    assert "gameinfer equilibria --scenario two_player --seed 0 --samples 96" in page
    (call,) = json.loads((report.folder / "planning-three_player/study.json").read_text())["calls"]
    for words in (call["date"], call["sources"], call["machine"]["numba"], call["machine"]["cpu"]):
        assert words in page


def test_every_study_leaves_its_data_and_figures(report: Report) -> None:
    for chapter in CHAPTERS:
        study = chapter.study(Scenario.load(chapter.scenario))
        name, folder = study.name, report.folder / f"{study.name}-{chapter.scenario}"
        for file in ("runs.csv", "study.json", "scenario.yaml", f"{name}.png", f"{name}.pdf"):
            assert (folder / file).stat().st_size > 0
        assert (folder / f"{name}.pdf").read_bytes().startswith(b"%PDF")


def test_a_second_call_makes_no_run_and_the_same_page(report: Report) -> None:
    before = {path: path.read_bytes() for path in report.folder.rglob("*") if path.is_file()}
    assert cli.main(["report", *OPTIONS, "--out", str(report.folder)]) == 0
    after = {path: path.read_bytes() for path in report.folder.rglob("*") if path.is_file()}
    assert [path.name for path in before if before[path] != after[path]] == []


def figures(aligned: list[float], baseline: list[float], half: float) -> dict[str, Any]:
    extra = [b - a for a, b in zip(aligned, baseline, strict=True)]
    return {
        MAP: {"mean_cost": aligned},
        BASELINE: {
            "mean_cost": baseline,
            "paired_extra_cost": extra,
            "paired_half_interval_95": [half] * len(aligned),
        },
    }


@pytest.mark.parametrize(
    ("aligned", "baseline", "half", "holds"),
    [
        ([690.0] * 3, [1200.0, 1000.0, 900.0], 50.0, [True, True, True, True]),
        ([690.0] * 3, [1200.0, 1000.0, 730.0], 50.0, [True, True, False, True]),
        ([690.0] * 3, [990.0, 1000.0, 900.0], 50.0, [True, False, True, False]),
        ([690.0, 690.0, 721.0], [1200.0, 1000.0, 900.0], 50.0, [False, True, True, True]),
        ([659.0, 690.0, 690.0], [1200.0, 1000.0, 900.0], 50.0, [False, True, True, True]),
    ],
)
def test_claims_about_three_players_can_fail(
    aligned: list[float], baseline: list[float], half: float, holds: list[bool]
) -> None:
    found = claims.of_planning("three_player", figures(aligned, baseline, half))
    assert [claim.holds for claim in found] == holds


@pytest.mark.parametrize(
    ("factor", "holds"), [(1.0, True), (1.09, True), (1.12, False), (0.88, False)]
)
def test_claims_about_five_unicycles_can_fail(factor: float, holds: bool) -> None:
    known = published.MEAN_COSTS["five_player_unicycle"]
    aligned = [factor * cost for cost in known[MAP]]
    found = claims.of_planning("five_player_unicycle", figures(aligned, list(known[BASELINE]), 1.0))
    assert found[0].holds is holds


def test_claims_without_intervals_do_not_hold() -> None:
    one = figures([690.0] * 3, [1200.0, 1000.0, 900.0], 50.0)
    one[BASELINE]["paired_half_interval_95"] = [None] * 3
    assert not claims.of_planning("three_player", one)[2].holds


@pytest.mark.parametrize(("inference", "baseline"), [(0.3, 2.5), (0.5, 2.5), (0.3, 1.9)])
def test_claims_about_prediction_can_fail(inference: float, baseline: float) -> None:
    peaks = {"inference": inference, "baseline": baseline}
    found = claims.of_prediction(
        "three_player",
        {name: {"peak": peak, "peak_look_ahead_s": 5.0} for name, peak in peaks.items()},
    )
    assert [claim.holds for claim in found] == [baseline > 2, inference < 0.4]


def test_claims_about_equilibria_can_fail() -> None:
    for count, holds in ((8, True), (7, False)):
        (claim,) = claims.of_equilibria("three_player", {"clusters": [{}] * count})
        assert claim.holds is holds
