"""Importing what takes long to import."""

from __future__ import annotations

import importlib
import os
import signal
from types import ModuleType

from gameinfer_ros.exit_codes import INTERRUPTED


def load(module: str) -> ModuleType:
    """Import a module of an executable; a Ctrl-C meanwhile ends the process, without a word.

    An exception would not do: libraries that are just being imported may swallow it.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler:  # whoever started us wants it otherwise
        return importlib.import_module(module)
    signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    try:
        return importlib.import_module(module)
    finally:
        signal.signal(signal.SIGINT, before)
