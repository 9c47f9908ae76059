"""Compiled code is never that of other sources."""

from __future__ import annotations

import ast
import os
import warnings
from pathlib import Path
from typing import Any

import pytest
from numba.core import config

from gameinfer_ros.lanes import compile_cache


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a file in a compiled room and one in another; no code is cached yet."""
    for file in ("solver/inner/a.py", "nodes/b.py"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    monkeypatch.setattr(compile_cache, "PACKAGE", tmp_path)
    monkeypatch.setattr(config, "CACHE_DIR", "")
    return tmp_path


def place(monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(config, "CACHE_DIR", "")
    compile_cache.keep_apart()
    return Path(config.CACHE_DIR)


def test_the_place_changes_with_what_is_compiled_and_with_nothing_else(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = place(monkeypatch)
    assert first.is_dir() and package in first.parents
    (package / "nodes/b.py").write_text("B = 2")
    assert place(monkeypatch) == first
    (first / "kernel.nbc").touch()
    (package / "solver/inner/a.py").write_text("A = 2")
    second = place(monkeypatch)
    assert second != first and second.is_dir()
    assert not first.exists(), "an outdated cache is removed"
    (package / "solver/inner/c.py").touch()
    assert place(monkeypatch) not in (first, second)


def used(path: Path) -> set[str]:
    """All that a file imports, as `module` or `module.name`, and what it takes of `numba`."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Attribute) and ast.unparse(node).startswith("numba."):
            found.add(ast.unparse(node))
    return found - {"numba.__version__"}


def compiles(path: Path) -> bool:
    """Whether a file makes compiled functions: by Numba, or by a subclass that holds kernels."""
    if any(name.startswith("numba.") or name.endswith((".kernel", ".njit")) for name in used(path)):
        return True
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    bases = (base for node in tree if isinstance(node, ast.ClassDef) for base in node.bases)
    return any(ast.unparse(base) in ("CostTerm", "Dynamics", "Vehicle") for base in bases)


def room(path: Path) -> str:
    return path.relative_to(compile_cache.PACKAGE).parts[0]


def test_every_file_with_compiled_functions_is_covered() -> None:
    compiled = [path for path in compile_cache.PACKAGE.rglob("*.py") if compiles(path)]
    assert {room(path) for path in compiled} == set(compile_cache.COMPILED)


def test_what_is_compiled_depends_on_no_file_that_is_not_covered() -> None:
    own = tuple(f"gameinfer_ros.{name}." for name in compile_cache.COMPILED)
    for name in compile_cache.COMPILED:
        for path in (compile_cache.PACKAGE / name).rglob("*.py"):
            ours = {name for name in used(path) if name.startswith("gameinfer_ros")}
            assert all(name.startswith(own) for name in ours), (path, ours)


def test_the_users_own_place_stays(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = str(tmp_path / "own")
    monkeypatch.setattr(config, "CACHE_DIR", own)
    compile_cache.keep_apart()
    assert own == config.CACHE_DIR
    assert not (package / "__pycache__").exists()


@pytest.mark.parametrize("chosen", [False, True])
def test_a_package_that_cannot_be_written_is_left_alone(
    chosen: bool, package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cache is then in the user's cache folder, also if `NUMBA_CACHE_DIR` is of no use."""
    monkeypatch.delenv("GAMEINFER_ROS_UNCACHED", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (package / "__pycache__").write_text("no folder")
    monkeypatch.setattr(config, "CACHE_DIR", "/dev/null/x" if chosen else "")
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        compile_cache.keep_apart()
    assert Path(config.CACHE_DIR).is_relative_to(tmp_path / "cache/gameinfer_ros")
    assert ["NUMBA_CACHE_DIR: /dev/null/x" in str(w.message) for w in found] == [True] * chosen


def test_a_cache_of_another_user_is_not_used(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It contains code that would be executed, and may not be readable."""
    first = place(monkeypatch)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    real = Path.stat

    def stat(path: Path, **options: Any) -> Any:
        found = real(path, **options)
        fields = list(found)
        fields[4] = 12345 if path == first else fields[4]
        return os.stat_result(fields)

    monkeypatch.setattr(Path, "stat", stat)
    assert place(monkeypatch).is_relative_to(tmp_path / "cache")


def test_without_any_place_children_share_a_temporary_one(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("GAMEINFER_ROS_UNCACHED", raising=False)
    monkeypatch.setattr(compile_cache, "_places", lambda: iter([Path("/dev/null/x")]))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for is_child in (False, True):
        monkeypatch.setattr(config, "CACHE_DIR", os.environ["NUMBA_CACHE_DIR"] if is_child else "")
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            compile_cache.keep_apart()
        assert Path(config.CACHE_DIR).parent == tmp_path
        assert ["Set NUMBA_CACHE_DIR" in str(w.message) for w in found] == [True] * (not is_child)


def test_functions_compile_where_nothing_can_be_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a disk that becomes full, or without a temporary folder."""
    monkeypatch.setenv("GAMEINFER_ROS_UNCACHED", "1")
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    full = compile_cache.njit(_twice)
    monkeypatch.setattr(
        "tempfile.TemporaryFile", lambda **_: (_ for _ in ()).throw(OSError(28, "disk full"))
    )
    assert full(2) == 4
    monkeypatch.setattr(config, "CACHE_DIR", "")
    assert compile_cache.njit(_twice)(3) == 6


def _twice(x: float) -> float:
    return 2 * x


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
