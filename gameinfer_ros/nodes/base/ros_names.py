"""Names in ROS arguments: of nodes, namespaces, topics, services and enclaves."""

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import NAMESPACE, NODE_NAMES, Argument
from gameinfer_ros.names.text import did_you_mean

#: One level of a name. ROS also refuses double underscores, except in enclaves.
LEVEL = r"(?!\w*__)[A-Za-z_]\w*"
_LEVEL_RULE = (
    "letters, digits and single underscores, and must not start with a digit or end with a slash"
)


class RosArgsError(ValueError):
    """An argument after --ros-args, or ROS_DOMAIN_ID, is invalid. The message says why."""


class _Kind(NamedTuple):
    """A kind of name.

    Attributes:
        pattern: what a name must match.
        longest: most characters. With these bounds, the longest name of a service, that of a
            parameter service, has the 247 characters that ROS allows.
        allowed: description of the allowed names.
        absolute: whether a name must start with a slash.
    """

    pattern: str
    longest: int
    allowed: str
    absolute: bool


_KINDS = {
    "namespace": _Kind(
        rf"/|(/{LEVEL})+", 140, f"must start with a slash, consist of {_LEVEL_RULE}", True
    ),
    "node name": _Kind(
        LEVEL,
        80,
        "must consist of letters, digits and single underscores, and must not start with a digit",
        False,
    ),
    "topic or service name": _Kind(
        rf"(~/|/)?{LEVEL}(/{LEVEL})*", 100, f"must consist of {_LEVEL_RULE}", False
    ),
    # It may include a namespace.
    "source of a remapping": _Kind(
        rf"(~/|/)?{LEVEL}(/{LEVEL})*", 247, f"must consist of {_LEVEL_RULE}", False
    ),
    "parameter name": _Kind(
        r"/?[A-Za-z_]\w*((\.|/|\./)[A-Za-z_]\w*)*",
        247,
        "must consist of letters, digits, underscores and dots, and must not start with a digit",
        False,
    ),
    "enclave": _Kind(
        r"/|(/[A-Za-z_]\w*)+",
        200,
        "must start with a slash, consist of letters, digits and underscores, and must not have "
        "a level that starts with a digit or end with a slash",
        True,
    ),
}


def check_names(for_ros: Iterable[str]) -> None:
    """Check the names in ROS arguments, without `--ros-args`.

    Raises:
        RosArgsError: a name is invalid.
    """
    for argument in ros_args.parse(for_ros):
        for what, name in _names(argument):
            kind = _KINDS[what]
            if len(name) > kind.longest:
                why = f"it must have at most {kind.longest} characters"
            elif not re.fullmatch(kind.pattern, name, re.ASCII):
                why = f"it {kind.allowed}{_suggestion(name, kind)}"
            else:
                continue
            raise RosArgsError(f"--ros-args: {argument}: this {what} is not allowed: {why}")


def _names(argument: Argument) -> Iterator[tuple[str, str]]:
    """Yield the names in an argument, and the kind of each."""
    if argument.flag in ("-e", "--enclave") and argument.value is not None:
        yield "enclave", argument.value
    rule = ros_args.rule(argument)
    if rule is None:
        return
    if rule.is_parameter:
        yield "parameter name", rule.name
    elif rule.name in NODE_NAMES:
        yield "node name", rule.value
    elif rule.name == NAMESPACE:
        yield "namespace", rule.value
    else:
        yield "source of a remapping", rule.name
        yield "topic or service name", rule.value


def _suggestion(name: str, kind: _Kind) -> str:
    """Suggest the name with slashes and underscores where they must be, if that makes it valid."""
    if name.startswith("__"):
        return did_you_mean(name, (*NODE_NAMES, NAMESPACE))
    start = "/" if kind.absolute or name.startswith("/") else ""
    levels = [re.sub(r"\W+|__+", "_", level, flags=re.ASCII) for level in name.split("/") if level]
    repaired = start + "/".join(levels)
    valid = all(level.strip("_") for level in levels) and re.fullmatch(
        kind.pattern, repaired, re.ASCII
    )
    return f"; did you mean {repaired}?" if levels and valid else ""
