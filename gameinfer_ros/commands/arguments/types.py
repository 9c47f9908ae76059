"""Types of arguments for argparse: each converts a text to a value, or raises an error."""

import argparse
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from gameinfer_ros.names.files import GIF, MP4
from gameinfer_ros.names.text import shorten


def whole_number(lowest: int, highest: int = 10**6) -> Callable[[str], int]:
    """Create a type for whole numbers from `lowest` to `highest`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = lowest - 1
        if not lowest <= value <= highest:
            why = f"it must be a whole number from {lowest} to {highest}"
            raise _not_allowed(shorten(text, 80), why)
        return value

    return parse


def share(text: str) -> float:
    """Convert a text to a share from 0 to 1."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1:
        raise _not_allowed(text, "it must be a number from 0 to 1")
    return value


def folder(text: str) -> Path:
    """Convert a text to the path of a folder, which need not exist."""
    if not text:  # `Path` would make it the current folder
        raise _not_allowed(text, "it must be the path of a folder; write . for the current one")
    return Path(text)


def animation_file(text: str) -> Path:
    """Convert a text to the path of a writable GIF, or MP4 if ffmpeg is installed."""
    path = Path(text)
    kind = path.suffix.lower()
    if kind not in (GIF, MP4):
        raise _not_allowed(text, f"its name must end in {GIF} or {MP4}")
    if path.is_dir() or not os.access(path.parent, os.W_OK | os.X_OK):
        raise _not_allowed(text, "it must be a file in a folder that exists and is writable")
    if kind == MP4 and shutil.which("ffmpeg") is None:
        why = f"{MP4} requires ffmpeg; install it, or choose a name that ends in {GIF}"
        raise _not_allowed(text, why)
    return path


def _not_allowed(text: str, why: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"'{text}' is not allowed: {why}")
