"""What killed processes leave in shared memory is removed, and nothing that anybody holds."""

from __future__ import annotations

import mmap
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gameinfer_ros.system.shared_memory import remove_abandoned

SEGMENT = "fastrtps_0123456789abcdef"
ALL = [
    *(SEGMENT, f"{SEGMENT}_el", "fastdds_0123456789abcdef"),
    *("fastrtps_port7411", "fastrtps_port7411_el", "fastrtps_port7411_sl"),
    "sem.fastrtps_port7411_mutex",
]
HOLD = "import sys, time; file = open(sys.argv[1], 'rb'); print(flush=True); time.sleep(600)"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ALL:
        (tmp_path / name).write_bytes(b"\0" * 4096)
    return tmp_path


@pytest.fixture
def holder(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Another process that has a segment open."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder / SEGMENT)], stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
        process.kill()


def test_what_nobody_holds_is_removed(folder: Path) -> None:
    assert remove_abandoned(folder) == sorted(ALL)
    assert not list(folder.iterdir())


def test_what_another_process_has_open_stays_until_that_is_killed(
    folder: Path, holder: subprocess.Popen[bytes]
) -> None:
    assert SEGMENT not in remove_abandoned(folder)
    assert [path.name for path in folder.iterdir()] == [SEGMENT]
    holder.kill()
    holder.wait(60.0)
    assert remove_abandoned(folder) == [SEGMENT]


def test_what_is_only_mapped_stays(folder: Path) -> None:
    with (folder / SEGMENT).open("r+b") as file:
        mapped = mmap.mmap(file.fileno(), 0)
    assert SEGMENT not in remove_abandoned(folder)
    mapped.close()
    assert remove_abandoned(folder) == [SEGMENT]


def test_nothing_else_is_touched(folder: Path) -> None:
    others = ["sem.loky-1", "fastrtps_", "fastrtps_0123456789abcdef_data", "my_fastrtps_port7411"]
    for name in others:
        (folder / name).touch()
    elsewhere = folder.parent / "elsewhere"
    elsewhere.touch()
    (folder / "fastrtps_fedcba9876543210").symlink_to(elsewhere)
    remove_abandoned(folder)
    left = {path.name for path in folder.iterdir()}
    assert left == {*others, "fastrtps_fedcba9876543210"}
    assert elsewhere.exists()


def test_signals_are_as_before(folder: Path) -> None:
    before = signal.getsignal(signal.SIGIO)
    remove_abandoned(folder)
    assert signal.getsignal(signal.SIGIO) == before


def test_without_shared_memory_there_is_nothing_to_do(tmp_path: Path) -> None:
    assert remove_abandoned(tmp_path / "none") == []
