"""ROS arguments on a command line."""

from collections.abc import Iterable


def split(args: Iterable[str]) -> tuple[list[str], list[str]]:
    """Split a command line into its own arguments and those between `--ros-args` and `--`."""
    own: list[str] = []
    for_ros: list[str] = []
    inside = False
    for arg in args:
        if arg == "--ros-args" or (inside and arg == "--"):
            inside = arg == "--ros-args"
        else:
            (for_ros if inside else own).append(arg)
    return own, for_ros
