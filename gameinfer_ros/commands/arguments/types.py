"""Types of arguments: each turns the text of an argument into its value, or says what is wrong."""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from gameinfer_ros.names.files import GIF, MP4


def whole_number(lowest: int, highest: int = 10**6) -> Callable[[str], int]:
    """A type for argparse: whole numbers from `lowest` to `highest`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = lowest - 1
        if not lowest <= value <= highest:
            shown = text if len(text) <= 80 else f"{text[:77]}..."
            raise argparse.ArgumentTypeError(
                f"'{shown}' is not allowed: it must be a whole number, {lowest} or above, "
                f"and at most {highest}"
            )
        return value

    return parse


def share(text: str) -> float:
    """The share that an option says.

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed: it must be from 0 to 1")
    return value


def new_folder(text: str) -> Path:
    """A type for argparse: a folder that is not there yet, or is empty."""
    folder = Path(text)
    try:
        free = not folder.exists() or not any(folder.iterdir())
    except OSError:  # a file, or nobody lets us look
        free = False
    if not free:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed: it must be a folder that does not exist yet or is empty"
        )
    return folder


def animation_file(text: str) -> Path:
    """A type for argparse: a GIF or MP4 file that can be written."""
    path = Path(text)
    kind = path.suffix.lower()
    if kind not in (GIF, MP4):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed: its name must end in {GIF} or {MP4}"
        )
    if path.is_dir() or not os.access(path.parent, os.W_OK | os.X_OK):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed: it must be a file in a folder that exists and that can be "
            "written to"
        )
    if kind == MP4 and shutil.which("ffmpeg") is None:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed: there is no ffmpeg to make it with; install ffmpeg, or "
            f"choose a name that ends in {GIF}"
        )
    return path
