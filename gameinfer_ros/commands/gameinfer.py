"""The executable `gameinfer`; it imports little before it handles signals."""

# PYTHON_ARGCOMPLETE_OK: shells with global completion look for this mark.
from collections.abc import Sequence

from gameinfer_ros.names.exit_codes import INTERRUPTED
from gameinfer_ros.system.forced_end import ForcedEnd
from gameinfer_ros.system.interruption import raise_by_default
from gameinfer_ros.system.load import load

#: Longest time that a process takes to end after its command has ended, in s.
END = 20.0


def command(args: Sequence[str] | None = None) -> int:
    """Run a subcommand as the last thing that a process does, and return its exit code."""
    code = main(args)
    ForcedEnd("the process").within(END, "its end")
    return code


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand, and return its exit code."""
    try:
        raise_by_default()
        return int(load("gameinfer_ros.commands.cli").main(args))
    except KeyboardInterrupt:
        return INTERRUPTED
