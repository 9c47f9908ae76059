"""The executable `gameinfer`, which imports little before signals are handled."""

# PYTHON_ARGCOMPLETE_OK: this is how shells that complete for all commands know that it answers.
from __future__ import annotations

from collections.abc import Sequence

from gameinfer_ros.names.exit_codes import INTERRUPTED
from gameinfer_ros.system.interruption import raise_by_default
from gameinfer_ros.system.load import load


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns its exit code."""
    try:
        raise_by_default()
        return int(load("gameinfer_ros.commands.cli").main(args))
    except KeyboardInterrupt:
        return INTERRUPTED
