"""Ends a process when the process that started it has ended."""

import ctypes
import os
import signal
import threading
from typing import NoReturn

#: Environment variable with the file descriptor of the pipe's end that the child reads.
VARIABLE = "GAMEINFER_ROS_LIFELINE"

#: How long a process may take to end after its parent has ended, in s, before it is killed.
PATIENCE = 5.0

#: Option of `prctl` for the signal that a process receives when its parent ends (`sys/prctl.h`).
_PR_SET_PDEATHSIG = 1


class Lifeline:
    """A pipe between a parent, which holds one end open, and its child, which reads the other.

    Attributes:
        inherited: file descriptor of the child's end, for `pass_fds` of `subprocess.Popen`.
    """

    def __init__(self) -> None:
        self.inherited, self._held = os.pipe()

    def tied(self) -> None:
        """Close the parent's copy of the child's end, after the child has started."""
        os.close(self.inherited)

    def let_go(self) -> None:
        """End the child, if it still runs, as the end of the parent would."""
        os.close(self._held)

    @property
    def environment(self) -> dict[str, str]:
        """Variables for the environment of the child."""
        return {VARIABLE: str(self.inherited)}


def watch() -> None:
    """End this process by SIGINT when its parent ends, if the parent has given it a lifeline.

    SIGINT lets a node clean up; a robot planner slows its base down. A stopped process (SIGSTOP)
    is continued and ends too. After `PATIENCE` seconds, the process is killed.
    """
    number = os.environ.pop(VARIABLE, None)  # children of this process must not inherit it
    if number is None:
        return
    os.set_inheritable(int(number), False)
    # A stopped process cannot notice that its parent has ended.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGCONT, 0, 0, 0)
    threading.Thread(target=_wait, args=(int(number),), name="lifeline", daemon=True).start()


def _wait(end: int) -> NoReturn:
    os.read(end, 1)  # nothing is ever written: returns when the other end is closed
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)  # SIGALRM kills a process that hangs
    os.kill(os.getpid(), signal.SIGINT)
    raise SystemExit
