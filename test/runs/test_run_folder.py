"""Folders of results."""

from __future__ import annotations

from pathlib import Path

import pytest

from gameinfer_ros.runs.folder import make_folder


def test_a_new_folder_is_called_by_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = make_folder(None, "bench")
    assert folder.is_dir()
    assert folder.parent == Path("results")
    assert "-bench-" in folder.name


def test_a_given_folder_may_be_there_already(tmp_path: Path) -> None:
    (tmp_path / "kept").touch()
    assert make_folder(tmp_path, "bench") == tmp_path
    assert make_folder(tmp_path / "new" / "one", "bench").is_dir()
    assert (tmp_path / "kept").exists()
