"""A second run is found out, and nobody else can get in the way of the first."""

from __future__ import annotations

import fcntl
import os
import pwd
from collections.abc import Callable
from pathlib import Path

import pytest

from gameinfer_ros.system.only_run import AnotherRunError, only_run


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the folder of the locks goes, which anybody can write to."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    tmp_path.chmod(0o1777)
    return tmp_path / f"gameinfer_ros-{os.getuid()}"


def refuse(words: str) -> None:
    """See that no run can begin, and that it is said why."""
    with pytest.raises(AnotherRunError, match=words), only_run(7, "/"):
        pass


def test_a_second_run_is_refused_and_one_elsewhere_is_not(folder: Path) -> None:
    with only_run(7, "/"):
        refuse("another run is in the ROS domain 7")
        with only_run(8, "/"), only_run(7, "/demo"):
            pass
    with only_run(7, "/"):
        pass


def test_nothing_is_left_of_a_lock_and_who_waits_for_it_locks_a_new_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock, flock, opened = folder / "7-.lock", fcntl.flock, []

    def late(file: int, operation: int) -> None:
        opened.append(file)
        if len(opened) == 1:  # another run ends between our opening and our locking
            lock.unlink()
        if len(opened) == 2:  # once more, and a third run has begun since
            lock.unlink()
            lock.touch()
        flock(file, operation)

    monkeypatch.setattr(fcntl, "flock", late)
    with only_run(7, "/"):
        assert len(opened) == 3
        refuse("another run is in the ROS domain 7")
    assert not any(folder.iterdir())


def test_nobody_else_can_put_anything_beside_the_lock(folder: Path) -> None:
    with only_run(7, "/"):
        assert folder.stat().st_mode & 0o777 == 0o700
        (lock,) = folder.iterdir()
        assert lock.stat().st_mode & 0o777 == 0o600


def a_folder_for_all(place: Path) -> None:
    place.mkdir()
    place.chmod(0o777)


def a_link(place: Path) -> None:
    elsewhere = place.with_name("elsewhere")
    elsewhere.mkdir(mode=0o700)
    place.symlink_to(elsewhere)


def a_dangling_link(place: Path) -> None:
    place.symlink_to(place.with_name("nowhere"))


@pytest.mark.parametrize("make", [a_folder_for_all, a_link, a_dangling_link, Path.touch, os.mkfifo])
def test_what_others_have_put_in_its_place_is_not_used(
    make: Callable[[Path], None], folder: Path
) -> None:
    make(folder)
    refuse(f"{folder} is not a folder that is yours alone.*remove it.*or set TMPDIR")
    assert not folder.with_name("nowhere").exists()
    assert not any(folder.iterdir() if folder.is_dir() else ())


def test_a_link_in_place_of_the_lock_is_not_followed(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    (folder / "7-.lock").symlink_to(folder / "target")
    refuse(r"7-\.lock")
    assert not (folder / "target").exists()


def test_it_is_said_whose_folder_is_in_its_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    me, somebody = pwd.getpwuid(os.getuid()).pw_name, os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: somebody)
    theirs = folder.with_name(f"gameinfer_ros-{somebody}")
    theirs.mkdir(mode=0o700)
    who = me if me == "root" else f"{me} and root"
    refuse(f"{theirs} is not .* yours alone: it belongs to {me} .* which {who} can do")


def test_where_no_folder_can_be_made_nothing_is_said_to_be_removed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(folder / "nowhere"))
    refuse("nowhere/.* cannot be made .No such file or directory., or set TMPDIR")


def test_where_nothing_can_be_written_it_is_said(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr("tempfile._candidate_tempdir_list", lambda: [str(folder / "nowhere")])
    refuse("No usable temporary directory found in .*, or set TMPDIR")


@pytest.mark.parametrize("session", ["theirs", "nowhere", None])
def test_runs_of_any_session_see_each_other(
    session: str | None, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ours").mkdir(mode=0o700)
    (tmp_path / "theirs").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "ours"))
    with only_run(7, "/"):
        if session is None:
            monkeypatch.delenv("XDG_RUNTIME_DIR")
        else:
            monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / session))
        refuse("another run is in the ROS domain 7")
