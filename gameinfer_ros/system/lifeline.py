"""Ties the life of a process to that of the one that started it."""

from __future__ import annotations

import ctypes
import os
import signal
import threading
from typing import NoReturn

#: Environment variable with the number of the pipe's end that a process listens to.
VARIABLE = "GAMEINFER_ROS_LIFELINE"

#: How long a process may take to end by itself once nobody holds the other end, in s.
PATIENCE = 5.0

#: Tells Linux which signal a process gets when its parent ends, from `sys/prctl.h`.
_PR_SET_PDEATHSIG = 1


class Lifeline:
    """A pipe that a parent holds for as long as it lives, and its child watches.

    Attributes:
        inherited: the end that the child must inherit; see `subprocess.Popen`'s `pass_fds`.
    """

    def __init__(self) -> None:
        self.inherited, self._held = os.pipe()

    def tied(self) -> None:
        """The child has been started: only it needs its end."""
        os.close(self.inherited)

    def let_go(self) -> None:
        """End the child, if it still runs, as the system does when we end."""
        os.close(self._held)

    @property
    def environment(self) -> dict[str, str]:
        """What the child needs in its environment."""
        return {VARIABLE: str(self.inherited)}


def watch() -> None:
    """End this process as by SIGINT when its parent is gone, if that has tied a lifeline to it.

    It ends at once, also if it was stopped (SIGSTOP), and by force after `PATIENCE`.
    """
    number = os.environ.pop(VARIABLE, None)  # it is not for what this process starts
    if number is None:
        return
    os.set_inheritable(int(number), False)
    # A stopped process could not see that its parent is gone.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGCONT, 0, 0, 0)
    threading.Thread(target=_wait, args=(int(number),), name="lifeline", daemon=True).start()


def _wait(end: int) -> NoReturn:
    os.read(end, 1)  # nobody writes: it returns when nobody is left who could
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)  # its signal ends whatever hangs
    os.kill(os.getpid(), signal.SIGINT)
    raise SystemExit
