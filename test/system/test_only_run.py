"""A second run is refused, and no other user can get in the way of the first."""

from __future__ import annotations

import os
import pwd
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from gameinfer_ros.system.only_run import AnotherRunError, only_run

#: Another run, which takes the lock and keeps it.
OTHER = """
import time
from gameinfer_ros.system.only_run import only_run
with only_run(7, "/"):
    print("locked", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the folder of the locks goes; any user can write around it."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    tmp_path.chmod(0o1777)
    return tmp_path / f"gameinfer_ros-{os.getuid()}"


def refuse(words: str) -> None:
    """Check that no run can begin, and that the message says why."""
    with pytest.raises(AnotherRunError, match=words), only_run(7, "/"):
        pass


def test_a_second_run_is_refused_and_one_elsewhere_is_not(folder: Path) -> None:
    with only_run(7, "/"):
        refuse("another run is in the ROS domain 7 and the namespace /, ")
        with only_run(8, "/"), only_run(7, "/demo"):
            pass
    with only_run(7, "/"):
        pass


def test_a_run_that_was_killed_is_not_in_the_way(folder: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", OTHER], stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"locked\n"
        refuse("another run is in the ROS domain 7")
        other.kill()
    with only_run(7, "/"):
        pass


def test_no_other_user_can_put_anything_beside_the_lock(folder: Path) -> None:
    with only_run(7, "/"):
        assert folder.stat().st_mode & 0o777 == 0o700


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
    refuse(f"{folder} is not a folder that only you can use.*remove it.*Or set TMPDIR")
    assert not folder.with_name("nowhere").exists()
    assert not any(folder.iterdir() if folder.is_dir() else ())


def test_the_message_names_the_owner_of_what_is_in_its_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    me, another = pwd.getpwuid(os.getuid()).pw_name, os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: another)
    theirs = folder.with_name(f"gameinfer_ros-{another}")
    theirs.mkdir(mode=0o700)
    refuse(f"{theirs} is not a folder that only you can use: it belongs to {me} ")


@pytest.mark.parametrize("place", ["the folder", "the lock"])
def test_what_cannot_be_made_is_named(
    place: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if place == "the folder":
        monkeypatch.setattr("tempfile.tempdir", str(folder / "nowhere"))
        refuse("No such file or directory: '.*/nowhere/.*Or set TMPDIR")
    else:
        (folder / "7-.lock").mkdir(parents=True)
        folder.chmod(0o700)
        refuse(r"Is a directory: '.*/7-\.lock'.*Or set TMPDIR")


def test_without_a_temporary_directory_the_message_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile._candidate_tempdir_list", lambda: [str(folder / "nowhere")])
    refuse("No usable temporary directory found in .*Or set TMPDIR")


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
