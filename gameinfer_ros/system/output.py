"""The output of commands."""

import os
from typing import Any

from rich.console import Console

from gameinfer_ros.names.text import json_text


def make_console(json: bool) -> Console:
    """Create the console for messages, tables and progress.

    It writes to stdout, or to stderr if stdout is reserved for a JSON object. ROS logs to stderr
    then, whatever its environment variables say.
    """
    if json:
        os.environ["RCUTILS_LOGGING_USE_STDOUT"] = "0"
    return Console(stderr=json, highlight=False, markup=False)


def print_json(figures: Any) -> None:
    """Print an object as one line of JSON on stdout."""
    print(json_text(figures), flush=True)
