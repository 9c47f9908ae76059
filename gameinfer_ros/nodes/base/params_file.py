"""Parameter files of ROS."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node

from gameinfer_ros.nodes.base.ros_names import RosArgsError

#: The key above the parameters of a node.
_PARAMETERS = "ros__parameters"

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


def sections(path: Path) -> list[Section]:
    """Read the sections of a file that ROS has accepted.

    Returns:
        The sections; none if the file is a pipe, which cannot be read a second time.

    Raises:
        RosArgsError: the file cannot be read, or is not a mapping.
    """
    found: list[Section] = []
    if not path.is_file():
        return found
    try:
        documents = list(YAML(typ="safe", pure=True).compose_all(path.read_bytes()))
    except (OSError, YAMLError, ValueError) as error:
        what = " ".join(str(error).split())
        raise RosArgsError(f"--params-file {path}: cannot be read: {what}") from None
    for document in filter(None, documents):  # an empty file has no content
        if not isinstance(document, MappingNode):
            raise RosArgsError(f"--params-file {path}: must contain a mapping of nodes")
        found += _sections(document, "")
    return found


def _sections(mapping: MappingNode, nodes: str) -> Iterator[Section]:
    for key, value in mapping.value:
        if key.value == _PARAMETERS:
            yield Section(nodes, dict(_parameters(value, "")))
        elif isinstance(value, MappingNode):
            yield from _sections(value, f"{nodes}/{key.value.lstrip('/')}")


def _parameters(value: Node, prefix: str) -> Iterator[tuple[str, Node]]:
    """Yield the names and values of parameters; levels of names are separated by dots."""
    if not isinstance(value, MappingNode):
        yield prefix, value
        return
    for key, child in value.value:
        yield from _parameters(child, f"{prefix}.{key.value}" if prefix else key.value)
