"""Makes sure that runs do not mix."""

from __future__ import annotations

import fcntl
import os
import pwd
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

    Runs with different folders for temporary files, as by `TMPDIR`, do not know of each other.

    Raises:
        AnotherRunError: there is one, or others can meddle with the place of the lock.
    """
    place = _own_folder() / f"{domain}{namespace.replace('/', '-')}.lock"
    try:
        file = _locked(place)
    except BlockingIOError:
        raise AnotherRunError(
            f"another run is in the ROS domain {domain} and the namespace {namespace}, and the "
            "two would mix: give one of them another ROS_DOMAIN_ID, or another namespace by "
            "--ros-args -r __ns:=/NAME"
        ) from None
    except OSError as error:
        raise _nobody_can_tell(f"{place} cannot be opened ({error.strerror}): remove it") from None
    try:
        yield
    finally:
        place.unlink(missing_ok=True)
        os.close(file)


def _locked(place: Path) -> int:
    """Open a file, made if needed, and lock it; the system releases it if we are killed.

    Raises:
        BlockingIOError: somebody else has locked it.
        OSError: it cannot be opened.
    """
    while True:
        file = os.open(place, os.O_CREAT | os.O_RDONLY | os.O_NOFOLLOW, mode=0o600)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(file), place.stat()):
                return file
        except FileNotFoundError:
            pass  # who had it before has just removed it
        except BaseException:
            os.close(file)
            raise
        os.close(file)


def _own_folder() -> Path:
    """A folder where nobody else can put anything, such as a lock that is never released.

    It is not that of the session: runs of cron, of `su` and of a desktop are to see each other.

    Raises:
        AnotherRunError: it cannot be made, or there is something else in its place.
    """
    try:
        place = Path(tempfile.gettempdir())
    except OSError as error:
        raise _nobody_can_tell(str(error.strerror)) from None
    folder = place / f"gameinfer_ros-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:
        pass  # a file or a link, of which more is said below
    except OSError as error:
        raise _nobody_can_tell(f"{folder} cannot be made ({error.strerror})") from None
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        owner = _name(found.st_uid)
        who = owner if owner == "root" else f"{owner} and root"
        raise _nobody_can_tell(
            f"{folder} is not a folder that is yours alone: it belongs to {owner} and has mode "
            f"{stat.filemode(found.st_mode)}; remove it, which {who} can do"
        )
    return folder


def _nobody_can_tell(why: str) -> AnotherRunError:
    return AnotherRunError(
        f"nobody can tell whether another run is going on: {why}, or set TMPDIR to a folder of "
        "your own, for all runs"
    )


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"the user {user}"
