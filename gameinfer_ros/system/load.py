"""Interruptible import of modules that take long to import."""

import importlib
import os
import signal
from types import ModuleType

from gameinfer_ros.names.exit_codes import INTERRUPTED
from gameinfer_ros.system.interruption import SIGNALS, interrupt

#: Handlers that may be replaced. Any other was chosen by the caller or the parent process.
_DEFAULTS = (signal.SIG_DFL, signal.default_int_handler, interrupt)


def load(module: str) -> ModuleType:
    """Import a module and return it. One of `SIGNALS` meanwhile ends the process silently.

    It raises no exception, because a library that is being imported may swallow it.
    """
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    replaced = {number: handler for number, handler in handlers.items() if handler in _DEFAULTS}
    for number in replaced:
        signal.signal(number, lambda *_: os._exit(INTERRUPTED))
    try:
        return importlib.import_module(module)
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)
