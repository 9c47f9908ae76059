"""Removes shared memory that killed processes with Fast DDS left behind."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import time
from pathlib import Path

#: Where Linux keeps shared memory.
FOLDER = Path("/dev/shm")  # noqa: S108 - nothing is created there

#: Segments, ports, their locks and mutexes. The former name of Fast DDS is Fast RTPS.
_NAME = re.compile(r"(sem\.)?fast(rtps|dds)_(port\d+|[0-9a-f]{16})(_el|_sl|_mutex)?")


def remove_abandoned(folder: Path = FOLDER) -> list[str]:
    """Remove the files of Fast DDS that no process uses, and return their names.

    Files of other users stay, and so does a file that any process has open or mapped, which a file
    lease detects.
    """
    removed = []
    try:
        names = sorted(name for name in os.listdir(folder) if _NAME.fullmatch(name))
    except OSError:  # the system has no shared memory
        return []
    # Sent when another process opens a leased file; by default, it would end this process.
    before = signal.signal(signal.SIGIO, signal.SIG_IGN)
    try:
        for name in names:
            if _remove(folder / name):
                removed.append(name)
    finally:
        signal.signal(signal.SIGIO, before)
    return removed


def let_go(patience: float = 5.0) -> None:
    """Wait until this process has unmapped all files of Fast DDS, after its nodes were destroyed.

    Fast DDS checks once a second whether it can release the files of another process.

    Args:
        patience: how long to wait at most, in s.
    """
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline and f"{FOLDER}/fast" in Path("/proc/self/maps").read_text():
        time.sleep(0.05)


def _remove(path: Path) -> bool:
    """Remove a file of this user that no process has open, and return whether it was removed."""
    try:
        file = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:  # it no longer exists, or belongs to another user
        return False
    try:
        # The lease is refused if the file is open or mapped elsewhere, or of another user. Until
        # the file is closed, another process that opens it waits and breaks the lease, which the
        # second call detects.
        fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_WRLCK)
        if fcntl.fcntl(file, fcntl.F_GETLEASE) != fcntl.F_WRLCK:
            return False
        path.unlink()
    except OSError:
        return False
    finally:
        os.close(file)
    return True
