"""A lock that prevents two runs from mixing."""

from __future__ import annotations

import os
import pwd
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout


class AnotherRunError(RuntimeError):
    """Raised if another run is in the same domain and namespace, or if this cannot be checked."""


@contextmanager
def only_run(domain: int, namespace: str) -> Iterator[None]:
    """Make sure that the user has no other run on this machine in the same domain and namespace.

    Runs with different folders for temporary files, as set by `TMPDIR`, do not see each other.

    Raises:
        AnotherRunError: there is another run, or other users can write to the folder of the lock.
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
    """Create and return a folder that other users cannot write to.

    In any other folder, another user could leave a lock that is never released. The folder does
    not belong to a session, so that runs from cron, `su` and a desktop see each other.

    Raises:
        AnotherRunError: its path exists, but is not such a folder.
        OSError: it cannot be created.
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
