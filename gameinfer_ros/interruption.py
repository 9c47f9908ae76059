"""Ctrl-C in the middle of anything."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: When an exception that was swallowed comes again, in s.
_LATER = 0.05


@contextmanager
def one_interruption() -> Iterator[None]:
    """Make SIGINT and SIGTERM end the block by a `KeyboardInterrupt`, whatever it is doing.

    Code that cannot be interrupted, such as callbacks of a compiler, may swallow the exception,
    which then comes once more, or fail with another one, which becomes a `KeyboardInterrupt` too.
    """
    received = False
    complain = sys.unraisablehook

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal received
        received = True
        raise KeyboardInterrupt

    def swallowed(unraisable: Any) -> None:
        if received and issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _LATER)
        else:
            complain(unraisable)

    signals = (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)
    before = {number: signal.signal(number, interrupt) for number in signals}
    sys.unraisablehook = swallowed
    try:
        yield
        if received:  # swallowed at the very end
            raise KeyboardInterrupt
    except Exception as error:
        if received:
            raise KeyboardInterrupt from error
        raise
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = complain
        for number, handler in before.items():
            signal.signal(number, handler)
