"""Files for animations, on the command line."""

from __future__ import annotations

import argparse
import os
import shutil
from pathlib import Path

GIF, MP4 = ".gif", ".mp4"


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
