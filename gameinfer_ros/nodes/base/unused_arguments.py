"""Refuses ROS arguments that have no effect, which are probably misspelled."""

import re
from collections.abc import Collection, Iterable, Sequence
from difflib import SequenceMatcher
from pathlib import Path
from typing import NoReturn

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import Argument, Rule
from gameinfer_ros.names.text import did_you_mean, shorten
from gameinfer_ros.nodes.base.parameter_values import check_values
from gameinfer_ros.nodes.base.params_file import Section, sections
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.interface import ALL_PARAMETERS, NodeInterface, join, known_nodes

#: Smallest similarity of a misspelled name of a node to the correct one, from 0 to 1.
_SIMILAR = 0.8


def check_effect(for_ros: Iterable[str], nodes: Sequence[NodeInterface]) -> list[str]:
    """Check that all ROS arguments, without `--ros-args`, have an effect.

    A parameter file may also have sections for other nodes. A section for any name, such as
    `/**`, may have the parameters of all nodes of this package.

    Args:
        for_ros: the arguments.
        nodes: the nodes that get them, all in one namespace.

    Returns:
        Remarks on sections of parameter files for other nodes, to be shown to the user.

    Raises:
        RosArgsError: an argument has no effect. The message suggests the nearest name.
    """
    remarks: list[str] = []
    for argument in ros_args.parse(for_ros):
        rule = ros_args.rule(argument)
        if rule is not None and not any(node.uses(rule) for node in nodes):
            _refuse(argument, rule, nodes)
        if argument.value is not None and argument.flag == "--params-file":
            remarks += _check_file(Path(argument.value), nodes)
        if argument.flag == "--log-level":
            _check_logger(argument, nodes)
    return remarks


def check_effect_on(for_ros: Sequence[str], node: NodeInterface) -> list[str]:
    """Check that all ROS arguments have an effect on a node that gets them as they are.

    See `check_effect` and `check_values`, and `for_node` for the case of a namespace.
    """
    for argument in ros_args.parse(for_ros):
        rule = ros_args.rule(argument)
        if rule is not None and rule.is_parameter and rule.node and node.namespace != "/":
            short = f"{argument.flag} {rule.name}:={rule.value}"
            raise RosArgsError(
                f"--ros-args: {argument}: has no effect in the namespace {node.namespace}: write "
                f"{shorten(short, 200)}"
            )
    remarks = check_effect(for_ros, [node])
    check_values(for_ros, node)
    return remarks


def for_node(for_ros: Iterable[str], node: NodeInterface) -> list[str]:
    """Return the ROS arguments that have an effect on a node.

    In `-p NODE:NAME:=VALUE`, ROS takes NODE for a node without namespace. The node is therefore
    removed, so that the parameter is set in any namespace.
    """
    kept: list[str] = []
    for argument in ros_args.parse(for_ros):
        rule = ros_args.rule(argument)
        if rule is None:
            kept += argument.words
        elif node.uses(rule):
            prefix = f"{rule.node}:" if rule.is_parameter and rule.node is not None else ""
            kept += [argument.flag, (argument.value or "").removeprefix(prefix)]
    return kept


def _refuse(argument: Argument, rule: Rule, nodes: Sequence[NodeInterface]) -> NoReturn:
    asked = [node for node in nodes if rule.node in (None, node.name)]
    if not asked:
        hint = did_you_mean(rule.node or "", [node.name for node in nodes])
        raise RosArgsError(
            f"--ros-args: {argument}: no node is called {rule.node}: {_names_of(nodes)}{hint}"
        )
    if rule.is_parameter:
        what, known = "parameter", {name for node in asked for name in node.parameters}
    else:
        services = [] if rule.scheme == "rostopic" else [s for n in asked for s in n.services]
        topics = [] if rule.scheme == "rosservice" else [t for n in asked for t in n.topics]
        what = " or ".join(["topic"] * bool(topics) + ["service"] * bool(services))
        known = {*topics, *services}
        if rule.name.startswith("/"):
            known = {node.expanded(name) for node in asked for name in known}
    hint = _hint(rule.name, known)
    if len(asked) == 1:
        raise RosArgsError(
            f"--ros-args: {argument}: the node {asked[0].name} has no {what} {rule.name}{hint}"
        )
    raise RosArgsError(
        f"--ros-args: {argument}: no node of this run has a {what} {rule.name}{hint}"
    )


def _hint(name: str, known: Collection[str]) -> str:
    ordered = sorted(known)
    return did_you_mean(name, ordered) or f": it must be one of {', '.join(ordered)}"


def _names_of(nodes: Sequence[NodeInterface]) -> str:
    names = ", ".join(node.name for node in nodes)
    return f"the nodes are {names}" if len(nodes) > 1 else f"the name of this node is {names}"


def _check_file(path: Path, nodes: Sequence[NodeInterface]) -> list[str]:
    field = f"--params-file {path}"
    full_names = _full_names(nodes)
    found = sections(path)
    foreign: list[Section] = []
    for section in found:
        meant = [node for node in nodes if section.is_for(node.full_name)]
        if meant:
            _check_section(field, section, meant)
        elif not any(map(section.is_for, full_names)):
            foreign.append(section)
    for section in foreign:
        hint = _meant_node(section.nodes, full_names)
        if hint:
            raise RosArgsError(f"{field}: {section.nodes}: no node is called that{hint}")
    names = shorten(", ".join(section.nodes for section in foreign), 200)
    if foreign and len(foreign) == len(found):
        hint = did_you_mean(foreign[0].nodes, full_names)
        raise RosArgsError(
            f"{field}: has no effect: it is for {names}; {_full_names_of(nodes)}{hint}"
        )
    remarks = [f"{field}: parameters for other nodes: {names}"] if foreign else []
    if path.is_file() and not any(section.parameters for section in found):
        remarks.append(f"{field}: contains no parameters")
    return remarks


def _full_names(nodes: Sequence[NodeInterface]) -> list[str]:
    """Full names of the nodes, and of others that may be in the same run."""
    others = known_nodes(nodes[0].namespace, nodes[0].players)
    if any(node.kind == "human_agent" for node in nodes):
        others.remove(join(nodes[0].namespace, "human_agent"))  # it is one of `nodes`, or renamed
    return [*(node.full_name for node in nodes), *others]


def _full_names_of(nodes: Sequence[NodeInterface]) -> str:
    names = ", ".join(node.full_name for node in nodes)
    return f"the nodes are {names}" if len(nodes) > 1 else f"this node is {names}"


def _check_section(field: str, section: Section, meant: Sequence[NodeInterface]) -> None:
    known = {name for node in meant for name in node.parameters}
    if section.is_for_any_name:
        known |= ALL_PARAMETERS
    for name in section.parameters:
        if name not in known:
            hint = _hint(name, known)
            raise RosArgsError(f"{field}: {section.nodes}: no node has a parameter {name}{hint}")


def _check_logger(argument: Argument, nodes: Sequence[NodeInterface]) -> None:
    name, assigned, _ = (argument.value or "").rpartition(":=")
    loggers = [full_name[1:].replace("/", ".") for full_name in _full_names(nodes)]
    last, known = name.rpartition(".")[2], [logger.rpartition(".")[2] for logger in loggers]
    if assigned and name not in loggers and (last in known or _is_misspelled(last, known)):
        hint = did_you_mean(name, loggers)
        raise RosArgsError(f"--ros-args: {argument}: no node has a logger {name}{hint}")


def _meant_node(nodes: str, full_names: Sequence[str]) -> str:
    """Suggest the full name of a node whose name is misspelled in a section, if it is."""
    name = nodes.rpartition("/")[2]
    known = {full_name.rpartition("/")[2]: full_name for full_name in full_names}
    return did_you_mean(name, known) if _is_misspelled(name, list(known)) else ""


def _is_misspelled(name: str, known: Sequence[str]) -> bool:
    """Whether a name is probably one of the known names, misspelled.

    It is not if it only has other numbers, as names of several nodes of a kind do, or if it extends
    a known name.
    """
    return (
        name not in known
        and not any(_is_variant(name, other) for other in known)
        and any(SequenceMatcher(None, name, other).ratio() >= _SIMILAR for other in known)
    )


def _is_variant(name: str, other: str) -> bool:
    if re.sub(r"\d+", "#", name) == re.sub(r"\d+", "#", other):
        return True
    return other in name and (len(name) > len(other) + 1 or name[-1].isdigit())
