"""Importing what takes long to import."""

from __future__ import annotations

import importlib
import os
import signal
from types import ModuleType

from gameinfer_ros.names.exit_codes import INTERRUPTED
from gameinfer_ros.system.interruption import SIGNALS, interrupt

#: What a signal does unless whoever started us wants it otherwise.
_USUAL = (signal.SIG_DFL, signal.default_int_handler, interrupt)


def load(module: str) -> ModuleType:
    """Import a module of an executable; an interrupt meanwhile ends the process, without a word.

    An exception would not do: libraries that are just being imported may swallow it.
    """
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    usual = {number: handler for number, handler in handlers.items() if handler in _USUAL}
    for number in usual:
        signal.signal(number, lambda *_: os._exit(INTERRUPTED))
    try:
        return importlib.import_module(module)
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
