"""Folders of studies: resumed, and never mixed up."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest
from matplotlib.figure import Figure
from rich.console import Console

from gameinfer_ros.experiments.study import (
    FailedRunError,
    Key,
    Row,
    Rows,
    Study,
    Table,
    folder,
    numbers,
)
from gameinfer_ros.experiments.study.folder import StudyFolder
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.runs.folder import FolderError
from gameinfer_ros.scenario import Scenario


@dataclass(frozen=True)
class Thirds(Study):
    """A study without games: thirds of numbers, until one fails."""

    failing: int | None = None

    name: ClassVar[str] = "thirds"
    description: ClassVar[str] = "Numbers are divided by three."
    time_columns: ClassVar[tuple[str, ...]] = ("ms",)

    @property
    def columns(self) -> tuple[str, ...]:
        return ("third",)

    def play(self, key: Key) -> Row:
        if key[0] == self.failing:
            raise FailedRunError("it fails")
        return {"third": int(key[0]) / 3, "ms": 1.5}

    def figures(self, rows: Rows) -> dict[str, Any]:
        return {"sum": float(numbers(rows, ["third"]).sum())}

    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        return []

    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> Figure:
        return Figure()


def complete(study: Study, path: Path, seeds: range, words: str = "a command") -> Rows:
    path.mkdir(exist_ok=True)
    console = Console(file=io.StringIO())
    return StudyFolder(path, study).complete(seeds, Workers(jobs=1), console, words)


def test_an_interrupted_study_goes_on_and_gives_the_same_files(
    two_player: Scenario, tmp_path: Path
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    rows = complete(Thirds(two_player), whole, range(3, 12))
    with pytest.raises(FailedRunError, match="it fails"):
        complete(Thirds(two_player, failing=7), parts, range(3, 12))
    kept = (parts / "runs.csv").read_text().splitlines()
    assert kept[0] == "seed,third" and len(kept) == 1 + 4
    assert complete(Thirds(two_player), parts, range(3, 12)) == rows
    for name in ("runs.csv", "times.csv", "scenario.yaml"):
        assert (parts / name).read_bytes() == (whole / name).read_bytes()
    assert [float(row["third"]) for row in rows] == [seed / 3 for seed in range(3, 12)]
    assert {row["ms"] for row in rows} == {"1.5"}


def test_what_was_not_put_in_order_yet_is(two_player: Scenario, tmp_path: Path) -> None:
    rows = complete(Thirds(two_player), tmp_path, range(4))
    for name in ("runs.csv", "times.csv"):
        whole = (tmp_path / name).read_bytes()
        header, *lines = whole.splitlines(keepends=True)
        (tmp_path / name).write_bytes(header + b"".join(reversed(lines)))
        assert complete(Thirds(two_player), tmp_path, range(4)) == rows
        assert (tmp_path / name).read_bytes() == whole


def test_a_run_whose_times_are_lost_is_made_again(two_player: Scenario, tmp_path: Path) -> None:
    rows = complete(Thirds(two_player), tmp_path, range(4))
    times = tmp_path / "times.csv"
    whole = times.read_bytes()
    times.write_bytes(whole[:-6])
    assert complete(Thirds(two_player), tmp_path, range(4)) == rows
    assert times.read_bytes() == whole


def test_a_broken_description_is_named(two_player: Scenario, tmp_path: Path) -> None:
    complete(Thirds(two_player), tmp_path, range(1))
    whole = (tmp_path / "study.json").read_text()
    for broken in (whole[:100], "[]", "{}"):
        (tmp_path / "study.json").write_text(broken)
        with pytest.raises(FolderError, match="is not a valid description of a study"):
            complete(Thirds(two_player), tmp_path, range(1))


def test_what_is_there_is_not_made_again(two_player: Scenario, tmp_path: Path) -> None:
    rows = complete(Thirds(two_player), tmp_path, range(5), "the first")
    # Any run would fail now.
    again = [complete(Thirds(two_player, failing=seed), tmp_path, range(5)) for seed in range(5)]
    assert again == [rows] * 5
    assert complete(Thirds(two_player), tmp_path, range(2, 4)) == rows[2:4]
    complete(Thirds(two_player), tmp_path, range(7), "the second")
    calls = json.loads((tmp_path / "study.json").read_text())["calls"]
    assert [call["command"] for call in calls] == ["the first", "the second"]
    assert all({"cpu", "cores", "python", "numpy", "numba"} <= set(c["machine"]) for c in calls)


def test_another_scenario_is_refused(two_player: Scenario, tmp_path: Path) -> None:
    complete(Thirds(two_player), tmp_path, range(2))
    content = two_player.model_dump() | {"steps": 50}
    other = Scenario.model_validate(content)
    with pytest.raises(FolderError, match=r"scenario\.steps is 101 there, but 50 here"):
        complete(Thirds(other), tmp_path, range(2))
    # Threads make no difference to results.
    content = two_player.model_dump() | {"solver": {"method": "iterative_lq", "threads": 2}}
    assert complete(Thirds(Scenario.model_validate(content)), tmp_path, range(2))
    content = two_player.model_dump()  # but another robot is another scenario
    content["players"] = dict(reversed(content["players"].items()))
    wanted = r"scenario\.players is robot, human_1 there, but human_1, robot here"
    with pytest.raises(FolderError, match=wanted):
        complete(Thirds(Scenario.model_validate(content)), tmp_path, range(2))


def test_a_study_older_than_a_field_is_resumed_if_the_field_has_its_default(
    two_player: Scenario, tmp_path: Path
) -> None:
    rows = complete(Thirds(two_player), tmp_path, range(2))
    file = tmp_path / "study.json"
    found = json.loads(file.read_text())
    for player in found["scenario"]["players"].values():
        del player["radius"]
    del found["scenario"]["inference"]["patience"]
    file.write_text(json.dumps(found))
    content = two_player.model_dump()
    content["players"]["robot"]["radius"] = 0.2
    wanted = r"scenario\.players\.robot\.radius is 0\.0 there, but 0\.2 here"
    with pytest.raises(FolderError, match=wanted):
        complete(Thirds(Scenario.model_validate(content)), tmp_path, range(2))
    assert complete(Thirds(two_player, failing=0), tmp_path, range(2)) == rows
    del found["scenario"]["steps"]  # it has no default
    file.write_text(json.dumps(found))
    with pytest.raises(FolderError, match="contains another study"):
        complete(Thirds(two_player), tmp_path, range(2))


def test_runs_of_other_sources_are_told(
    two_player: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    complete(Thirds(two_player), tmp_path, range(2))
    monkeypatch.setattr(folder, "fingerprint", lambda: "others")
    told = io.StringIO()
    study = StudyFolder(tmp_path, Thirds(two_player))
    study.complete(range(3), Workers(jobs=1), Console(file=told, width=300), "another command")
    assert "contains runs made by other sources" in told.getvalue()
    assert [call["sources"] == "others" for call in study.calls] == [False, True]


def test_another_study_is_refused(two_player: Scenario, tmp_path: Path) -> None:
    class Halves(Thirds):
        name: ClassVar[str] = "halves"

    complete(Thirds(two_player), tmp_path, range(2))
    with pytest.raises(FolderError, match="study is 'thirds' there, but 'halves' here"):
        complete(Halves(two_player), tmp_path, range(2))


def test_the_scenario_that_was_played_is_kept(five_player: Scenario, tmp_path: Path) -> None:
    StudyFolder(tmp_path, Thirds(five_player))
    assert Scenario.load(tmp_path / "scenario.yaml") == five_player
