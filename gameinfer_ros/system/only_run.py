"""Prevents two runs in the same domain and namespace."""

import os
import pwd
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout


class AnotherRunError(RuntimeError):
    """Another run is in the same domain and namespace, or this cannot be checked."""


@contextmanager
def only_run(domain: int, namespace: str) -> Iterator[None]:
    """Prevent other runs of the user in the same domain and namespace on this machine.

    The lock is in the temporary folder. Runs with different values of `TMPDIR` do not exclude each
    other.

    Raises:
        AnotherRunError: another run has the lock, or other users can write to its folder.
    """
    try:
        folder = _private_folder()
        lock = FileLock(folder / f"{domain}{namespace.replace('/', '-')}.lock", timeout=0)
        lock.acquire()
    except Timeout:
        raise AnotherRunError(
            f"another run is in the ROS domain {domain} and the namespace {namespace}, and the "
            "two would mix: give one of them another ROS_DOMAIN_ID, or another namespace by "
            "--ros-args -r __ns:=/NAME"
        ) from None
    except OSError as error:
        raise _cannot_check(str(error)) from None
    try:
        yield
    finally:
        lock.release()


def _private_folder() -> Path:
    """Create a folder to which no other user can write, so that none can hold the lock.

    The runtime folder of a session would not exclude runs of another session of the same user.
    """
    folder = Path(tempfile.gettempdir()) / f"gameinfer_ros-{os.getuid()}"
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        owner = _name(found.st_uid)
        raise _cannot_check(
            f"{folder} is not a folder that only you can use: it belongs to {owner} and has mode "
            f"{stat.filemode(found.st_mode)}; its owner or root can remove it"
        )
    return folder


def _cannot_check(why: str) -> AnotherRunError:
    return AnotherRunError(
        f"cannot check for another run: {why}. Or set TMPDIR, for all runs, to a folder of your own"
    )


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"the user {user}"
