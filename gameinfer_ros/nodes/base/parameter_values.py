"""Refuses values of parameters, in ROS arguments, that are not those that a node gets."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ruamel.yaml.nodes import ScalarNode, SequenceNode

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import Argument
from gameinfer_ros.nodes.base.parameter_yaml import INTEGER, read, type_of
from gameinfer_ros.nodes.base.params_file import sections
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.interface import NodeInterface


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
            kind = type_of(value)
            octal = re.fullmatch(r"([-+]?)0+([0-7]+)", value.value) if kind == INTEGER else None
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
        ValueError: a value cannot be read.
    """
    rule = ros_args.rule(argument)
    if rule is not None and rule.is_parameter and node.uses(rule):
        yield f"/{rule.node or '**'}", rule.name, read(rule.value)
    elif argument.flag == "--params-file" and argument.value is not None:
        for section in sections(Path(argument.value)):
            if section.is_for(node.full_name):
                for name, value in section.parameters.items():
                    yield section.nodes, name, value


def _field(argument: Argument) -> str:
    return str(argument) if argument.flag == "--params-file" else f"--ros-args: {argument}"
