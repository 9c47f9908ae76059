"""Handling of Ctrl-C and of the other signals that end a process."""

import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from traceback import clear_frames
from types import FrameType
from typing import Any, NoReturn

from gameinfer_ros.system import closed_terminal

#: The signals that end a process: Ctrl-C, a request of another process, a closed terminal.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

#: Time after which a swallowed exception is raised again, in s.
_LATER = 0.05


class Interruption(KeyboardInterrupt):
    """Raised when the process receives one of `SIGNALS`.

    It is a class of its own because a plain `KeyboardInterrupt` that has left an `exec` makes
    `python -m` end the process by SIGINT, even if it was handled. Libraries that generate code
    call `exec`.
    """


def interrupt(number: int, frame: FrameType | None) -> NoReturn:
    """Raise `Interruption`; a handler for `signal.signal`."""
    if number == signal.SIGHUP:
        closed_terminal.leave()  # messages about the interruption could not be written
    raise Interruption


def raise_by_default() -> None:
    """Make each of `SIGNALS` raise `Interruption`, unless it has a custom handler."""
    for number in SIGNALS:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, interrupt)


@contextmanager
def one_interruption() -> Iterator[None]:
    """Make each of `SIGNALS` end the block with an `Interruption`, whatever it executes.

    Code that cannot be interrupted, such as a compiler's callback, may swallow the exception or
    fail with another one. A swallowed exception is raised again. Another one is replaced by an
    `Interruption`. Objects that the signal left half made are destroyed, and exceptions in their
    destructors are ignored.
    """
    received = False
    report = sys.unraisablehook

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal received
        received = True
        interrupt(number, frame)

    def swallowed(unraisable: Any) -> None:
        if received and issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _LATER)
        elif not received or getattr(unraisable.object, "__name__", None) != "__del__":
            report(unraisable)

    before = _handle((*SIGNALS, signal.SIGALRM), handle)
    sys.unraisablehook = swallowed
    try:
        yield
        if received:  # swallowed at the very end
            raise Interruption
    except BaseException as error:
        if received:
            _clear(error)
            if isinstance(error, Exception):
                raise Interruption from error
        raise
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = report
        _restore(before)


def _clear(error: BaseException | None) -> None:
    """Drop what the frames of an exception, and of those before it, refer to."""
    while error is not None:
        clear_frames(error.__traceback__)
        error = error.__context__


def raise_on_interrupt() -> None:
    """Make each of `SIGNALS` raise `Interruption` from now on."""
    handle_interrupts(interrupt)


def handle_interrupts(handler: Callable[[int, FrameType | None], None]) -> None:
    """Make each of `SIGNALS` call a handler from now on."""
    _handle(SIGNALS, handler)


def ignore_interrupts() -> None:
    """Ignore `SIGNALS` from now on; one more may interrupt before this returns."""
    _handle((signal.SIGINT, signal.SIGTERM), signal.SIG_IGN)
    _handle((signal.SIGHUP,), lambda *_: closed_terminal.leave())


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Defer `SIGNALS` to the end of the block, where only the first one is handled."""
    received: list[int] = []
    before = _handle((*SIGNALS, signal.SIGALRM), lambda number, _: received.append(number))
    try:
        yield
    finally:
        _restore(before)
        for number in received[:1]:
            signal.raise_signal(number)


def _handle(numbers: Sequence[signal.Signals], handler: Any) -> dict[signal.Signals, Any]:
    """Set the handler of some signals and return their previous handlers."""
    # A process started by nohup ignores SIGHUP and must continue to.
    numbers = [
        number
        for number in numbers
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN
    ]
    return {number: signal.signal(number, handler) for number in numbers}


def _restore(handlers: Mapping[signal.Signals, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)
