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


def raise_on_interrupt() -> None:
    """Make what is to end this process raise `KeyboardInterrupt` from now on."""
    _on_interrupt(_interrupt)


def ignore_interrupts() -> None:
    """Let nothing interrupt this process from now on."""
    _on_interrupt(signal.SIG_IGN)


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Let an interrupt wait until the end of the block."""
    received: list[int] = []
    _on_interrupt(lambda number, _: received.append(number))
    try:
        yield
    finally:
        _on_interrupt(_interrupt)
    if received:
        raise KeyboardInterrupt


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _on_interrupt(handler: Any) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN or handler is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, handler)  # the terminal is closed, and this is no nohup
