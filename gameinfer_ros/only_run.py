"""Makes sure that runs do not mix."""

from __future__ import annotations

import fcntl
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class AnotherRunError(RuntimeError):
    """Another run is in the same domain and namespace, or nobody can tell; the message says why."""


@contextmanager
def only_run(domain: int, namespace: str) -> Iterator[None]:
    """Make sure that the user has no other run on this machine in the same domain and namespace.

    Raises:
        AnotherRunError: there is one, or others can meddle with the place of the lock.
    """
    name = f"{domain}{namespace.replace('/', '-')}.lock"
    try:
        flags = os.O_CREAT | os.O_RDONLY | os.O_NOFOLLOW
        file = os.open(_own_folder() / name, flags, mode=0o600)
    except OSError as error:
        raise AnotherRunError(
            f"nobody can tell whether another run is going on: {error}: remove it, or set "
            "XDG_RUNTIME_DIR to a folder that is yours alone"
        ) from None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # released by the system if we are killed
        yield
    except BlockingIOError:
        raise AnotherRunError(
            f"another run is in the ROS domain {domain} and the namespace {namespace}, and the "
            "two would mix: give one of them another ROS_DOMAIN_ID, or another namespace by "
            "--ros-args -r __ns:=/NAME"
        ) from None
    finally:
        os.close(file)


def _own_folder() -> Path:
    """A folder where nobody else can put anything, such as a lock that is never released.

    Raises:
        OSError: there is something else in its place.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime or tempfile.gettempdir()) / f"gameinfer_ros-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise PermissionError(f"{folder} is not a folder that is yours alone")
    return folder
