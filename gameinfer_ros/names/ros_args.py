"""The grammar of ROS arguments."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from gameinfer_ros.names.text import shorten

#: Flags that are followed by a value.
WITH_VALUE = (
    *("-p", "--param", "-r", "--remap", "--params-file", "-e", "--enclave"),
    *("--log-level", "--log-config-file"),
)

#: Flags without a value.
SWITCHES = tuple(
    f"--{state}-{logs}-logs"
    for state in ("enable", "disable")
    for logs in ("rosout", "stdout", "external-lib")
)

#: The special sources of remappings: name and namespace of a node.
NODE_NAMES, NAMESPACE = ("__node", "__name"), "__ns"


@dataclass(frozen=True)
class Argument:
    """A flag, and its value if it takes one."""

    flag: str
    value: str | None = None

    @property
    def words(self) -> list[str]:
        """The words on the command line."""
        return [self.flag] if self.value is None else [self.flag, self.value]

    def __str__(self) -> str:
        text = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(self.words))
        return shorten(text, 200)


class Rule(NamedTuple):
    """A parameter or a remapping.

    Attributes:
        node: name of the node it applies to; None for all nodes.
        scheme: `rostopic` or `rosservice` if a remapping applies to only one of them, or empty.
        name: the parameter, or the source of a remapping.
        value: the value of the parameter, or the target of a remapping.
    """

    is_parameter: bool
    node: str | None
    scheme: str
    name: str
    value: str

    @property
    def is_special(self) -> bool:
        """Whether it remaps the name or namespace of a node."""
        return not self.is_parameter and self.name in (*NODE_NAMES, NAMESPACE)


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


def parse(for_ros: Iterable[str]) -> list[Argument]:
    """Group the words between `--ros-args` and `--` into arguments."""
    words = iter(for_ros)
    return [Argument(w, next(words, None)) if w in WITH_VALUE else Argument(w) for w in words]


def rule(argument: Argument) -> Rule | None:
    """Return the parameter or remapping that an argument sets; None if it is of another kind.

    Invalid rules, which ROS refuses, have any content.
    """
    flag, text = argument.flag, argument.value
    if text is None or flag not in ("-p", "--param", "-r", "--remap"):
        return None
    left, _, value = text.partition(":=")
    found = re.fullmatch(r"(?:([^:]*):(?!//))?(?:(rostopic|rosservice)://)?(.*)", left, re.DOTALL)
    assert found is not None  # everything matches the last group
    node, scheme, name = found.groups()
    return Rule(flag in ("-p", "--param"), node, scheme or "", name, value)
