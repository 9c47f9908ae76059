"""Removes shared memory that Fast DDS could not, because its process was killed."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import time
from pathlib import Path

#: Where Linux keeps shared memory.
FOLDER = Path("/dev/shm")  # noqa: S108 - nothing is made there

#: Segments, ports, their locks and mutexes; Fast DDS was once called Fast RTPS.
_NAME = re.compile(r"(sem\.)?fast(rtps|dds)_(port\d+|[0-9a-f]{16})(_el|_sl|_mutex)?")


def remove_abandoned(folder: Path = FOLDER) -> list[str]:
    """Remove the files of Fast DDS that no process has open any more; returns their names.

    Only those of this user are looked at. A file that anybody has open or mapped stays, whoever
    that is: the system itself tells, by a lease.
    """
    removed = []
    try:
        names = sorted(name for name in os.listdir(folder) if _NAME.fullmatch(name))
    except OSError:  # there is no shared memory, so nothing is left in it
        return []
    # It comes if somebody opens a file just now, and would end us.
    before = signal.signal(signal.SIGIO, signal.SIG_IGN)
    try:
        for name in names:
            if _remove(folder / name):
                removed.append(name)
    finally:
        signal.signal(signal.SIGIO, before)
    return removed


def let_go(patience: float = 5.0) -> None:
    """Wait until this process, whose nodes have been destroyed, has no file of Fast DDS open.

    Fast DDS looks once a second whether it may let go of what belonged to another process.
    """
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline and f"{FOLDER}/fast" in Path("/proc/self/maps").read_text():
        time.sleep(0.05)


def _remove(path: Path) -> bool:
    """Remove a file if it is ours and nobody has it open; returns whether it has been removed."""
    try:
        file = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:  # it is gone, or of another user
        return False
    try:
        # Refused if there is any other open file or mapping, or if we are not the owner. Until
        # we close the file, whoever wants to open it has to wait, which the second call tells.
        fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_WRLCK)
        if fcntl.fcntl(file, fcntl.F_GETLEASE) != fcntl.F_WRLCK:
            return False
        path.unlink()
    except OSError:
        return False
    finally:
        os.close(file)
    return True
