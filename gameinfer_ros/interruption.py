"""Ctrl-C in the middle of anything."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def one_interruption() -> Iterator[None]:
    """Make SIGINT and SIGTERM end the block by a `KeyboardInterrupt`, whatever it is doing.

    Code that cannot be interrupted, such as callbacks of a compiler, may swallow the exception, and
    go on or fail with another one; that becomes a `KeyboardInterrupt` too.
    """
    received = False
    complain = sys.unraisablehook

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal received
        received = True
        raise KeyboardInterrupt

    def complain_of_others(unraisable: Any) -> None:
        if not (received and issubclass(unraisable.exc_type, KeyboardInterrupt)):
            complain(unraisable)

    before = {
        number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)
    }
    sys.unraisablehook = complain_of_others
    try:
        yield
        if received:
            raise KeyboardInterrupt
    except Exception as error:
        if received:
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = complain
        for number, handler in before.items():
            signal.signal(number, handler)
