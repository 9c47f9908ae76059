"""Ctrl-C in the middle of anything, and what else is to end a process."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

from gameinfer_ros.system import closed_terminal

#: By these a process is told to end: by Ctrl-C, by another process, and by a closed terminal.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

#: When an exception that was swallowed comes again, in s.
_LATER = 0.05


class Interruption(KeyboardInterrupt):
    """One of `SIGNALS` came.

    Once a `KeyboardInterrupt` itself has left an `exec`, Python ends the process as if nobody had
    handled it, whatever its exit code (`python -m` only); libraries that make code use `exec`.
    """


def interrupt(number: int, frame: FrameType | None) -> NoReturn:
    """Handle a signal by an `Interruption`; see `signal.signal`."""
    if number == signal.SIGHUP:
        closed_terminal.leave()  # or what is said of the interruption could not be written
    raise Interruption


def raise_by_default() -> None:
    """Make each of `SIGNALS` that nobody handles in a way of their own raise `Interruption`."""
    for number in SIGNALS:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, interrupt)


@contextmanager
def one_interruption() -> Iterator[None]:
    """Make each of `SIGNALS` end the block by an `Interruption`, whatever it is doing.

    Code that cannot be interrupted, such as callbacks of a compiler, may swallow the exception,
    which then comes once more, or fail with another one, which becomes an `Interruption` too.
    """
    received = False
    complain = sys.unraisablehook

    def remember(number: int, frame: FrameType | None) -> None:
        nonlocal received
        received = True
        interrupt(number, frame)

    def swallowed(unraisable: Any) -> None:
        if received and issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _LATER)
        else:
            complain(unraisable)

    before = _handle((*SIGNALS, signal.SIGALRM), remember)
    sys.unraisablehook = swallowed
    try:
        yield
        if received:  # swallowed at the very end
            raise Interruption
    except Exception as error:
        if received:
            raise Interruption from error
        raise
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = complain
        _restore(before)


def raise_on_interrupt() -> None:
    """Make what is to end this process raise `Interruption` from now on."""
    _handle(SIGNALS, interrupt)


def ignore_interrupts() -> None:
    """Let nothing interrupt this process from now on; before that is done, one more may."""
    _handle((signal.SIGINT, signal.SIGTERM), signal.SIG_IGN)
    _handle((signal.SIGHUP,), lambda *_: closed_terminal.leave())


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Let an interrupt wait until the end of the block, for the handlers that were there before."""
    received: list[int] = []
    before = _handle((*SIGNALS, signal.SIGALRM), lambda number, _: received.append(number))
    try:
        yield
    finally:
        _restore(before)
        for number in received[:1]:
            signal.raise_signal(number)


def _handle(numbers: Sequence[signal.Signals], handler: Any) -> dict[signal.Signals, Any]:
    """Set the handler of some signals; returns those that they had."""
    # Who ignores that the terminal is closed was started by nohup.
    numbers = [
        number
        for number in numbers
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN
    ]
    return {number: signal.signal(number, handler) for number in numbers}


def _restore(handlers: Mapping[signal.Signals, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)
