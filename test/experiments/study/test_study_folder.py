"""Folders of studies: gone on with, and never mixed up."""

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

from gameinfer_ros.experiments.study import Key, Row, Rows, Study, Table, numbers
from gameinfer_ros.experiments.study.folder import FolderError, StudyFolder
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.scenario import Scenario


class FailureError(Exception):
    """Stands for whatever interrupts a study."""


@dataclass(frozen=True)
class Thirds(Study):
    """A study without games: thirds of numbers, until one fails."""

    failing: int | None = None

    name: ClassVar[str] = "thirds"
    time_columns: ClassVar[tuple[str, ...]] = ("ms",)

    @property
    def columns(self) -> tuple[str, ...]:
        return ("third",)

    def play(self, key: Key) -> Row:
        if key[0] == self.failing:
            raise FailureError
        return {"third": int(key[0]) / 3, "ms": 1.5}

    def figures(self, rows: Rows) -> dict[str, Any]:
        return {"sum": float(numbers(rows, ["third"]).sum())}

    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        return []

    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> Figure:
        return Figure()


def complete(study: Study, path: Path, seeds: range, words: str = "a command") -> Rows:
    console = Console(file=io.StringIO())
    return StudyFolder(path, study).complete(seeds, Workers(jobs=1), console, words)


def test_an_interrupted_study_goes_on_and_gives_the_same_files(
    two_player: Scenario, tmp_path: Path
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    rows = complete(Thirds(two_player), whole, range(3, 12))
    with pytest.raises(FailureError):
        complete(Thirds(two_player, failing=7), parts, range(3, 12))
    kept = (parts / "runs.csv").read_text().splitlines()
    assert kept[0] == "seed,third" and len(kept) == 1 + 4
    assert complete(Thirds(two_player), parts, range(3, 12)) == rows
    for name in ("runs.csv", "times.csv", "scenario.yaml"):
        assert (parts / name).read_bytes() == (whole / name).read_bytes()
    assert [float(row["third"]) for row in rows] == [seed / 3 for seed in range(3, 12)]
    assert {row["ms"] for row in rows} == {"1.5"}


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
    with pytest.raises(FolderError, match=r"scenario\.steps is 101 there, and 50 here"):
        complete(Thirds(other), tmp_path, range(2))
    # Threads make no difference to results.
    content = two_player.model_dump() | {"solver": {"threads": 2}}
    assert complete(Thirds(Scenario.model_validate(content)), tmp_path, range(2))


def test_another_study_is_refused(two_player: Scenario, tmp_path: Path) -> None:
    class Halves(Thirds):
        name: ClassVar[str] = "halves"

    complete(Thirds(two_player), tmp_path, range(2))
    with pytest.raises(FolderError, match="study is 'thirds' there, and 'halves' here"):
        complete(Halves(two_player), tmp_path, range(2))


def test_the_scenario_that_was_played_is_kept(five_player: Scenario, tmp_path: Path) -> None:
    StudyFolder(tmp_path, Thirds(five_player))
    assert Scenario.load(tmp_path / "scenario.yaml") == five_player
