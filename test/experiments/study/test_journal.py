"""Journals: tables that survive being interrupted."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from gameinfer_ros.experiments.study.journal import Journal, JournalError

KEYS, COLUMNS = ("seed", "planner"), ("cost", "steps")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs.csv"


def fill(path: Path, *seeds: int) -> Journal:
    journal = Journal(path, KEYS, COLUMNS)
    for seed in seeds:
        journal.append((seed, "map"), {"cost": 0.1 * seed, "steps": 7, "other": "left out"})
    return journal


def test_rows_are_on_disk_as_soon_as_they_are_appended(path: Path) -> None:
    fill(path, 3, 1)
    assert path.read_text() == "seed,planner,cost,steps\n3,map,0.30000000000000004,7\n1,map,0.1,7\n"
    read = Journal(path, KEYS, COLUMNS)
    assert list(read.rows) == [(3, "map"), (1, "map")]


def test_numbers_come_back_to_the_last_bit(path: Path) -> None:
    journal = Journal(path, KEYS, COLUMNS)
    numbers = [math.pi, 1 / 3, 1e-300, 123456789.123456789, 5e-324]
    for seed, number in enumerate(numbers):
        journal.append((seed, "map"), {"cost": number, "steps": 0})
    rows = Journal(path, KEYS, COLUMNS).rows.values()
    assert [float(row["cost"]) for row in rows] == numbers


def test_sorted_files_are_the_same_whatever_the_order_was(path: Path, tmp_path: Path) -> None:
    fill(path, 10, 9, 2).sort()
    other = tmp_path / "other.csv"
    fill(other, 2, 10)
    fill(other, 9).sort()
    assert other.read_bytes() == path.read_bytes()
    assert [line.split(",")[0] for line in path.read_text().splitlines()[1:]] == ["2", "9", "10"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["other.csv", "runs.csv"]


@pytest.mark.parametrize("cut", [1, 5, 12])
def test_a_line_that_was_not_finished_is_dropped(path: Path, cut: int) -> None:
    fill(path, 1, 2)
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    assert list(Journal(path, KEYS, COLUMNS).rows) == [(1, "map")]
    fill(path, 2)
    assert path.read_bytes() == whole


def test_a_header_that_was_not_finished_is_dropped(path: Path) -> None:
    path.write_text("seed,pla")
    fill(path, 1)
    assert path.read_text().splitlines()[0] == "seed,planner,cost,steps"
    assert list(Journal(path, KEYS, COLUMNS).rows) == [(1, "map")]


def test_a_later_row_replaces_an_earlier_one(path: Path) -> None:
    journal = fill(path, 1)
    journal.append((1, "map"), {"cost": 5.0, "steps": 8})
    again = Journal(path, KEYS, COLUMNS)
    assert again.rows[(1, "map")]["cost"] == "5.0"
    again.sort()
    assert len(path.read_text().splitlines()) == 2


def test_other_columns_are_refused(path: Path) -> None:
    fill(path, 1)
    with pytest.raises(JournalError, match=r"runs.csv: the columns differ.*'cost', 'price'"):
        Journal(path, KEYS, ("price", "steps"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("4,map,1.0", "line 3 has 3 values instead of 4"),
        ("x,map,1,2", "line 3: seed: 'x' is not allowed"),
    ],
)
def test_a_broken_line_is_named(path: Path, line: str, words: str) -> None:
    fill(path, 1)
    with path.open("a") as file:
        file.write(line + "\n")
    with pytest.raises(JournalError, match=words):
        Journal(path, KEYS, COLUMNS)
