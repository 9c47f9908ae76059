"""Parameter files of ROS."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.text import did_you_mean
from gameinfer_ros.nodes.base.parameter_yaml import complaint
from gameinfer_ros.nodes.base.ros_names import RosArgsError

#: The key above the parameters of a node.
_PARAMETERS = "ros__parameters"

#: How to set a parameter.
_FORM = f"NODE: {{{_PARAMETERS}: {{NAME: VALUE}}}}"

#: The full name of a node, perhaps with wildcards, as in a file.
_LEVEL = r"([A-Za-z_]\w*|\*\*?)"
_NODE = rf"/?{_LEVEL}(/{_LEVEL})*"

#: What the wildcards match: one level of a name, and any number of levels.
_WILDCARDS = {"/*": r"/\w+", "/**": r"(/\w+)*"}


class Section(NamedTuple):
    """The parameters in a file for one node, or for several if `nodes` has wildcards.

    It starts in a `line` of the file.
    """

    nodes: str
    parameters: dict[str, ScalarNode | SequenceNode]
    line: int

    def is_for(self, full_name: str) -> bool:
        """Whether the section applies to a node."""
        pattern = re.sub(r"/\*\*?", lambda found: _WILDCARDS[found[0]], self.nodes)
        return re.fullmatch(pattern, full_name) is not None

    @property
    def is_for_any_name(self) -> bool:
        """Whether the section applies to nodes with any name, perhaps in one namespace only."""
        return self.nodes.endswith("*")


def check_files(for_ros: Iterable[str]) -> None:
    """Check the form of the parameter files in ROS arguments, without `--ros-args`.

    Raises:
        RosArgsError: a file is invalid; see `sections`.
    """
    for argument in ros_args.parse(for_ros):
        if argument.flag == "--params-file" and argument.value is not None:
            sections(Path(argument.value))


def sections(path: Path) -> list[Section]:
    """Read the sections of a file.

    Returns:
        The sections; none if the file is a pipe, which cannot be read a second time.

    Raises:
        RosArgsError: the file cannot be read, has duplicate keys, duplicate nodes or aliases, or is
            not a mapping of nodes to mappings of parameters with values.
    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            return []
        data = path.read_bytes()
        yaml = YAML(typ="safe", pure=True)
        alias = next((e for e in yaml.parse(data) if isinstance(e, AliasEvent)), None)
        if alias is not None:
            raise _ContentError(alias, f"ROS does not support aliases: replace *{alias.anchor}")
        found: dict[str, Section] = {}
        for document in list(YAML(typ="safe", pure=True).compose_all(data)):
            for section, key in _of_document(document):
                earlier = found.setdefault(section.nodes, section)
                if earlier is not section:
                    raise _ContentError(
                        key, f"{section.nodes}: duplicate node: it is in line {earlier.line} too"
                    )
        return list(found.values())
    except _ContentError as error:
        raise RosArgsError(f"--params-file {path}: {error}") from None
    except OSError as error:
        raise RosArgsError(f"--params-file {path}: cannot be read: {error.strerror}") from None
    except MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        what = f"{line}cannot be read as YAML: {error.problem}"
        raise RosArgsError(f"--params-file {path}: {what}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        what = " ".join(str(error).split())
        raise RosArgsError(f"--params-file {path}: cannot be read: {what}") from None


class _ContentError(ValueError):
    """The content of a file is invalid. The message names the line."""

    def __init__(self, place: Any, why: str) -> None:
        super().__init__(f"line {place.start_mark.line + 1}: {why}")


def _of_document(document: Node | None) -> Iterator[tuple[Section, ScalarNode]]:
    if isinstance(document, MappingNode):
        yield from _sections(document, "")
    elif document is not None:  # an empty file has no content
        raise _ContentError(document, "must contain a mapping of nodes")


def _sections(mapping: MappingNode, path: str) -> Iterator[tuple[Section, ScalarNode]]:
    """Yield the sections below the keys in `path`, each with a key for messages about it."""
    pairs = list(_pairs(mapping))
    for i, (key, value) in enumerate(pairs):
        if key.value == _PARAMETERS:
            _check_nodes(key, path)
            nodes = f"/{path.removeprefix('/')}"
            if not isinstance(value, MappingNode):
                why = f"{nodes}: {_PARAMETERS} must contain a mapping of parameters"
                raise _ContentError(key, why)
            if i + 1 < len(pairs):  # ROS may add what follows to these parameters
                after = pairs[i + 1][0]
                why = f"{nodes}: {after.value} must be above {_PARAMETERS}, or below another node"
                raise _ContentError(after, why)
            yield Section(nodes, _parameters(value, nodes), key.start_mark.line + 1), key
            continue
        inner = f"{path.removesuffix('/')}/{key.value}" if path else key.value
        if not isinstance(value, MappingNode) or not value.value:
            name = f"/{inner.removeprefix('/')}"
            hints = (did_you_mean(level, [_PARAMETERS]) for level in name.split("/"))
            hint = next(filter(None, hints), "")
            why = f"{name}: is not below {_PARAMETERS}: write {_FORM}{hint}"
            if isinstance(value, MappingNode):
                why = f"{name}: has no parameters: write {_FORM}{hint}"
            raise _ContentError(key, why)
        yield from _sections(value, inner)


def _check_nodes(key: ScalarNode, path: str) -> None:
    """Check the keys above `ros__parameters`, whose `key` is for the message."""
    if not path:
        why = f"{_PARAMETERS} must be below the name of a node, such as /**"
        raise _ContentError(key, why)
    if not re.fullmatch(_NODE, path, re.ASCII):
        raise _ContentError(
            key,
            f"{path}: this name of a node is not allowed: its levels must consist of letters, "
            "digits and underscores, and must not start with a digit, or be * or **",
        )


def _parameters(mapping: MappingNode, nodes: str) -> dict[str, ScalarNode | SequenceNode]:
    """Return the parameters by name; levels of names are separated by dots."""
    found: dict[str, ScalarNode | SequenceNode] = {}
    for key, value in _pairs(mapping):
        if isinstance(value, MappingNode) and value.value:
            inner = _parameters(value, nodes)
        elif isinstance(value, ScalarNode | SequenceNode) and not complaint(value):
            inner = {"": value}
        else:
            why = complaint(None if isinstance(value, MappingNode) else value)
            raise _ContentError(key, f"{nodes}: {key.value} {why}")
        for rest, child in inner.items():
            name = f"{key.value}.{rest}" if rest else key.value
            if name in found:
                line = found[name].start_mark.line + 1
                raise _ContentError(
                    child, f"{nodes}: duplicate key {name!r}: it is in line {line} too"
                )
            found[name] = child
    return found


def _pairs(mapping: MappingNode) -> Iterator[tuple[ScalarNode, Node]]:
    """Yield the keys and values of a mapping without duplicate keys."""
    lines: dict[str, int] = {}
    for key, value in mapping.value:
        if not isinstance(key, ScalarNode):
            raise _ContentError(key, "a key must be text, not a list or a mapping")
        if not key.value:
            raise _ContentError(key, "a key must not be empty")
        if key.value in lines:
            line = lines[key.value]
            raise _ContentError(key, f"duplicate key {key.value!r}: it is in line {line} too")
        lines[key.value] = key.start_mark.line + 1
        yield key, value
