"""Ties the life of a process to that of the one that started it."""

from __future__ import annotations

import ctypes
import os
import signal

#: Environment variable with the process id of the parent.
VARIABLE = "GAMEINFER_ROS_PARENT"

#: Sets the signal that a process gets when its parent ends, from `sys/prctl.h`.
_PR_SET_PDEATHSIG = 1


def environment() -> dict[str, str]:
    """Variables for a child that is to end with the thread of this process that starts it."""
    return {VARIABLE: str(os.getpid())}


def watch() -> None:
    """Kill this process as soon as its parent is gone, if that has set `environment`.

    Only SIGKILL also ends a process that is stopped (SIGSTOP) or hangs.
    """
    parent = os.environ.pop(VARIABLE, None)  # it is not for what this process starts
    if parent is None:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != int(parent):  # it ended before
        os.kill(os.getpid(), signal.SIGKILL)
