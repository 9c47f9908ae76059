"""The command `gameinfer`, also as `python -m gameinfer_ros`; imports little before it is safe."""

# PYTHON_ARGCOMPLETE_OK: this is how shells that complete for all commands know that it answers.
from __future__ import annotations

import sys

from gameinfer_ros.load import load


def main() -> int:
    """Run a subcommand; returns its exit code."""
    return int(load("gameinfer_ros.cli").main())


if __name__ == "__main__":
    sys.exit(main())
