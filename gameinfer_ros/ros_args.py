"""Arguments for ROS on a command line."""

from __future__ import annotations

from collections.abc import Sequence


def split(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """Our own arguments, and those that stand between --ros-args and -- or the end."""
    if "--ros-args" not in args:
        return list(args), []
    start = args.index("--ros-args")
    end = args.index("--", start) if "--" in args[start:] else len(args)
    return [*args[:start], *args[end + 1 :]], list(args[start + 1 : end])
