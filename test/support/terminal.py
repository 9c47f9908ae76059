"""A terminal that a command has."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import termios


class Terminal:
    """A terminal for a command, which can be closed.

    Args:
        controls: whether the command hears, by SIGHUP, that it is closed.
    """

    def __init__(self, controls: bool) -> None:
        self.controls = controls
        self._ours, self.its_end = pty.openpty()
        self._read = b""

    def take(self) -> None:
        """Become the terminal of this process, which has been started for it."""
        if self.controls:
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    @property
    def words(self) -> str:
        while select.select([self._ours], [], [], 0)[0]:
            self._read += os.read(self._ours, 65536)
        return self._read.decode(errors="replace")

    def close(self) -> None:
        os.close(self._ours)
