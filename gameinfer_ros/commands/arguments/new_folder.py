"""Folders to be made, on the command line."""

from __future__ import annotations

import argparse
from pathlib import Path


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
