"""Signals that would end a process before its nodes notice."""

import signal
import threading
from types import FrameType

from rclpy.signals import SignalHandlerOptions, get_current_signal_handlers_options

from gameinfer_ros.system import closed_terminal
from gameinfer_ros.system.interruption import interrupt

#: The options with which rclpy handles a signal.
_BY_RCLPY = {
    signal.SIGINT: (SignalHandlerOptions.ALL, SignalHandlerOptions.SIGINT),
    signal.SIGTERM: (SignalHandlerOptions.ALL, SignalHandlerOptions.SIGTERM),
    signal.SIGHUP: (),
}


def treat_like_ctrl_c() -> None:
    """From now on, let SIGTERM and SIGHUP end this process like Ctrl-C, unless they are handled.

    Without a handler, they end a process at once. rclpy never handles SIGHUP, and its options can
    exclude SIGTERM. Handlers of the program, and signals that it ignores, stay as they are. Python
    only sets handlers in the main thread; in another one, this function has no effect.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL and not _is_handled_by_rclpy(number):
            signal.signal(number, _on_signal)


def _on_signal(number: int, frame: FrameType | None) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and not _is_handled_by_rclpy(
        signal.SIGINT
    ):
        interrupt(number, frame)
    if number == signal.SIGHUP:
        closed_terminal.leave()
    signal.raise_signal(signal.SIGINT)


def _is_handled_by_rclpy(number: signal.Signals) -> bool:
    return get_current_signal_handlers_options() in _BY_RCLPY[number]
