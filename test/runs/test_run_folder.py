"""Folders of results: each belongs to one command."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

from gameinfer_ros.runs.folder import (
    BAG,
    BENCHMARK,
    REPORT,
    RUN,
    STUDY,
    FolderError,
    contents,
    results_folder,
)

#: A file of each.
FILES = {
    RUN: "parameters/simulator.yaml",
    STUDY: "runs.csv",
    REPORT: "report.html",
    BENCHMARK: "bench.json",
    BAG: "metadata.yaml",
}


def fill(folder: Path, kind: str) -> None:
    file = folder / FILES[kind]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()


def test_a_new_folder_is_called_by_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with results_folder(None, BENCHMARK, "bench") as folder:
        assert folder.is_dir()
        assert folder.parent == Path("results")
        assert "-bench-" in folder.name
        (folder / "bench.json").touch()
    assert folder.exists()
    with results_folder(tmp_path / "new" / "one", BENCHMARK) as folder:
        assert folder.is_dir()
    assert not folder.exists(), "nothing was written"


def test_a_folder_with_other_files_may_be_used(tmp_path: Path) -> None:
    for name in ("notes.txt", "scenario.yaml", "logs/mine.log"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    for kind in FILES:
        for overwrite in (False, True):
            with results_folder(tmp_path, kind, overwrite=overwrite):
                pass
    assert (tmp_path / "scenario.yaml").exists() and (tmp_path / "logs/mine.log").exists()


def refuse(words: str, *arguments: Any, **options: Any) -> None:
    with (
        pytest.raises(FolderError, match=re.escape(words)),
        results_folder(*arguments, **options),
    ):
        pass


@pytest.mark.parametrize("kind", FILES)
def test_earlier_results_are_refused_resumed_or_deleted(kind: str, tmp_path: Path) -> None:
    fill(tmp_path, kind)
    (tmp_path / "notes.txt").touch()
    with (
        pytest.raises(FolderError, match=re.escape(f"{tmp_path} contains the results of {kind}")),
        results_folder(tmp_path, kind),
    ):
        pass
    with results_folder(tmp_path, kind, resume=True):
        assert contents(tmp_path) == kind
    with results_folder(tmp_path, kind, overwrite=True):
        assert contents(tmp_path) is None
    assert (tmp_path / "notes.txt").exists()


def test_nothing_is_left_of_players_who_are_no_longer_there(tmp_path: Path) -> None:
    fill(tmp_path, RUN)
    for name in ("parameters/human_9_agent.yaml", "logs/human_9_agent.log", "picture.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    with results_folder(tmp_path, RUN, overwrite=True):
        assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize("there", FILES)
@pytest.mark.parametrize("here", FILES)
def test_results_of_another_kind_are_never_replaced(there: str, here: str, tmp_path: Path) -> None:
    if there == here:
        return
    fill(tmp_path, there)
    for overwrite in (False, True):
        with (
            pytest.raises(FolderError, match=f"contains {there}, and {here}"),
            results_folder(tmp_path, here, overwrite=overwrite, resume=True),
        ):
            pass
    assert contents(tmp_path) == there


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    fill(tmp_path, RUN)
    with results_folder(tmp_path, RUN, overwrite=True):
        fill(tmp_path, RUN)
        for kind in FILES:
            with (
                pytest.raises(FolderError, match=f"--x: {tmp_path} is in use by another command"),
                results_folder(tmp_path, kind, overwrite=True, resume=True, option="--x"),
            ):
                pass
    assert contents(tmp_path) == RUN
    with results_folder(tmp_path, RUN, overwrite=True):
        pass


def test_a_process_that_dies_unlocks_its_folder(tmp_path: Path) -> None:
    child = os.fork()
    if child == 0:
        results_folder(tmp_path, RUN).__enter__()
        os._exit(0)
    os.waitpid(child, 0)
    with results_folder(tmp_path, RUN):
        pass


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "out"):
        with (
            pytest.raises(OSError, match=f"--out: {out} cannot be created"),
            results_folder(out, RUN),
        ):
            pass
