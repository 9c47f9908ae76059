"""Refuses values of parameters, in ROS arguments, that are not those that a node gets."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import Node, ScalarNode, SequenceNode

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import Argument
from gameinfer_ros.nodes.base.params_file import sections
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.interface import NodeInterface

_INTEGER = "an integer"

#: How ROS reads plain scalars, which is nearly YAML 1.1. All others are text.
_TYPES = {
    "a boolean": r"[Yy]|yes|Yes|YES|[Nn]|no|No|NO|true|True|TRUE|false|False|FALSE"
    r"|on|On|ON|off|Off|OFF",
    _INTEGER: r"[-+]?([1-9][0-9]*|0[0-7]*|0[xX][0-9a-fA-F]+)",
    "a double": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)"
    r"|\.(nan|NaN|NAN)",
}


def check_values(for_ros: Sequence[str], node: NodeInterface) -> None:
    """Check that a node gets the values of parameters that its arguments say.

    For each parameter and section, such as `/**`, ROS keeps one value of each type, and the node
    gets one of these, not always the last. If several sections have the parameter, the node gets
    the value of the section that appears last; `-p` belongs to the section `/**`.

    Args:
        for_ros: the ROS arguments of the node, without `--ros-args`.
        node: the node.

    Raises:
        RosArgsError: a value replaces one of another type, `-p` has no effect, or ROS reads a
            decimal number as an octal one.
    """
    found: dict[str, dict[str, tuple[str, Argument]]] = {}
    for argument in ros_args.parse(for_ros):
        for section, name, value in values(argument, node):
            kind = _type(value)
            octal = re.fullmatch(r"([-+]?)0+([0-7]+)", value.value) if kind == _INTEGER else None
            if octal is not None:
                raise RosArgsError(
                    f"{_field(argument)}: {name}: ROS reads {value.value} as the octal number "
                    f"{int(value.value, 8)}: write {octal[1]}{octal[2]}"
                )
            earlier, where = found.setdefault(section, {}).setdefault(name, (kind, argument))
            if earlier != kind:
                raise RosArgsError(
                    f"{_field(argument)}: {name} is {kind} here, but {earlier} in {where}, and ROS "
                    "may use either value: write both as the same type"
                )
            found[section][name] = kind, argument
    for names in found.values():
        for name, (_, argument) in names.items():
            used = [others[name][1] for others in found.values() if name in others][-1]
            if argument.flag != "--params-file" and used.flag == "--params-file":
                raise RosArgsError(
                    f"{_field(argument)}: has no effect, because ROS prefers the value that {used} "
                    f"has for {node.full_name}: remove one of them"
                )


def values(
    argument: Argument, node: NodeInterface
) -> Iterator[tuple[str, str, ScalarNode | SequenceNode]]:
    """Yield the section, name and value of the parameters that an argument sets for a node.

    Raises:
        RosArgsError: a parameter file cannot be read.
    """
    rule = ros_args.rule(argument)
    found: list[tuple[str, str, Node | None]] = []
    if rule is not None and rule.is_parameter and node.uses(rule):
        try:
            value = YAML(typ="safe", pure=True).compose(rule.value)
        except YAMLError:
            return  # left to ROS
        found = [(f"/{rule.node or '**'}", rule.name, value)]
    elif argument.flag == "--params-file" and argument.value is not None:
        for section in sections(Path(argument.value)):
            if section.is_for(node.full_name):
                found += [(section.nodes, name, v) for name, v in section.parameters.items()]
    for nodes, name, value in found:
        if isinstance(value, ScalarNode | SequenceNode):
            yield nodes, name, value


def _type(value: ScalarNode | SequenceNode) -> str:
    if isinstance(value, SequenceNode):
        return "a list"
    if value.style is None:  # without quotes
        for name, pattern in _TYPES.items():
            if re.fullmatch(pattern, value.value):
                return name
    return "text"


def _field(argument: Argument) -> str:
    return str(argument) if argument.flag == "--params-file" else f"--ros-args: {argument}"
