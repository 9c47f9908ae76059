"""Compiled code is never that of other sources."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import pytest
from numba.core import config

from gameinfer_ros.lanes import compile_cache


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of two files, whose code has no place yet."""
    (tmp_path / "inner").mkdir()
    (tmp_path / "a.py").write_text("A = 1")
    (tmp_path / "inner/b.py").write_text("B = 1")
    monkeypatch.setattr(compile_cache, "PACKAGE", tmp_path)
    monkeypatch.setattr(config, "CACHE_DIR", "")
    return tmp_path


def place(monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(config, "CACHE_DIR", "")
    compile_cache.keep_apart()
    return Path(config.CACHE_DIR)


def test_the_place_is_another_one_if_any_file_changes(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = place(monkeypatch)
    assert first.is_dir() and package in first.parents
    assert place(monkeypatch) == first
    (first / "kernel.nbc").touch()
    (package / "inner/b.py").write_text("B = 2")
    second = place(monkeypatch)
    assert second != first and second.is_dir()
    assert not first.exists(), "what nobody can use any more is removed"
    (package / "inner/c.py").touch()
    assert place(monkeypatch) not in (first, second)


def test_the_users_own_place_stays(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", "/somewhere/else")
    compile_cache.keep_apart()
    assert config.CACHE_DIR == "/somewhere/else"
    assert not (package / "__pycache__").exists()


def test_a_package_that_cannot_be_written_is_left_alone(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)
    compile_cache.keep_apart()
    assert config.CACHE_DIR == ""
    assert not (package / "__pycache__").exists()


def test_this_package_uses_it() -> None:
    own = compile_cache.PACKAGE / "__pycache__"
    assert config.CACHE_DIR.startswith(f"{own}/numba-") or "NUMBA_CACHE_DIR" in os.environ


@pytest.mark.parametrize(("mode", "warned"), [(0o777, True), (0o1777, True), (0o755, False)])
def test_a_place_of_the_user_that_anybody_can_write_to_is_warned_of(
    mode: int, warned: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(mode)
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        compile_cache.keep_apart()
    assert [str(tmp_path) in str(w.message) for w in found] == [True] * warned


def test_others_cannot_write_to_the_place(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = os.umask(0)
    try:
        mode = place(monkeypatch).stat().st_mode
    finally:
        os.umask(before)
    assert not mode & 0o022
