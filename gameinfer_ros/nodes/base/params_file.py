"""Parameter files of ROS."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.text import did_you_mean
from gameinfer_ros.nodes.base.ros_names import RosArgsError

#: The key above the parameters of a node.
_PARAMETERS = "ros__parameters"

#: How to set a parameter.
_FORM = f"NODE: {{{_PARAMETERS}: {{NAME: VALUE}}}}"

#: What the wildcards match: one level of a name, and any number of levels.
_WILDCARDS = {"/*": r"/\w+", "/**": r"(/\w+)*"}


class Section(NamedTuple):
    """The parameters in a file for one node, or for several if `nodes` has wildcards."""

    nodes: str
    parameters: dict[str, Node]

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
        RosArgsError: the file cannot be read, has duplicate keys or aliases, or is not a mapping of
            nodes to mappings of parameters.
    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            return []
        data = path.read_bytes()
        yaml = YAML(typ="safe", pure=True)
        alias = next((e for e in yaml.parse(data) if isinstance(e, AliasEvent)), None)
        if alias is not None:
            raise _ContentError(alias, f"ROS does not support aliases: replace *{alias.anchor}")
        documents = list(YAML(typ="safe", pure=True).compose_all(data))
        return [section for document in documents for section in _of_document(document)]
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


def _of_document(document: Node | None) -> Iterator[Section]:
    if isinstance(document, MappingNode):
        yield from _sections(document, "")
    elif document is not None:  # an empty file has no content
        raise _ContentError(document, "must contain a mapping of nodes")


def _sections(mapping: MappingNode, nodes: str) -> Iterator[Section]:
    for key, value in _pairs(mapping):
        if key.value == _PARAMETERS:
            if not nodes:
                why = f"{_PARAMETERS} must be below the name of a node, such as /**"
                raise _ContentError(key, why)
            if not isinstance(value, MappingNode):
                raise _ContentError(
                    key, f"{nodes}: {_PARAMETERS} must contain a mapping of parameters"
                )
            yield Section(nodes, _parameters(value, nodes))
            continue
        name = f"{nodes}/{key.value.lstrip('/')}"
        if not isinstance(value, MappingNode):
            hints = (did_you_mean(level, [_PARAMETERS]) for level in name.split("/"))
            hint = next(filter(None, hints), "")
            raise _ContentError(key, f"{name}: is not below {_PARAMETERS}: write {_FORM}{hint}")
        yield from _sections(value, name)


def _parameters(mapping: MappingNode, nodes: str) -> dict[str, Node]:
    """Return the parameters by name; levels of names are separated by dots."""
    found: dict[str, Node] = {}
    for key, value in _pairs(mapping):
        inner = _parameters(value, nodes) if isinstance(value, MappingNode) else {"": value}
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
        if key.value in lines:
            line = lines[key.value]
            raise _ContentError(key, f"duplicate key {key.value!r}: it is in line {line} too")
        lines[key.value] = key.start_mark.line + 1
        yield key, value
