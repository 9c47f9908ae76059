"""Makes sure that runs do not mix."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class AnotherRunError(RuntimeError):
    """Another run is in the same domain and namespace; the message says what to do about it."""


@contextmanager
def only_run(domain: int, namespace: str) -> Iterator[None]:
    """Make sure that no other run of this machine is in the same domain and namespace.

    Raises:
        AnotherRunError: another one is.
    """
    name = f"gameinfer_ros-{domain}{namespace.replace('/', '-')}.lock"
    file = os.open(Path(tempfile.gettempdir()) / name, os.O_CREAT | os.O_RDONLY | os.O_NOFOLLOW)
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
