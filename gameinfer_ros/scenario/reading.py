"""Reading YAML that somebody else wrote, without being at its mercy."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml
from typing_extensions import override

from gameinfer_ros.scenario.files import ScenarioError

#: A file has at most so many characters, also when all aliases are written out.
LARGEST = 2**18


def load(path: Path) -> Any:
    """What a file holds.

    Raises:
        ScenarioError: it cannot be read, is no YAML, or is larger than `LARGEST`.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise ScenarioError(f"{path}: is too large: at most {LARGEST} bytes are allowed")
        return yaml.load(data.decode("utf-8"), _Loader)  # noqa: S506 - a safe one
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise ScenarioError(f"{path}: cannot be read as YAML: {error}") from None


class _Loader(yaml.SafeLoader):
    """Refuses keys that a mapping has twice, and aliases that make a file larger than it seems."""

    @override
    def get_single_node(self) -> yaml.Node | None:
        node = super().get_single_node()
        if node is not None:
            _written_out(node, {}, set())
        return node

    @override
    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
        except (ValueError, LookupError, AttributeError, TypeError) as error:
            # PyYAML leaves it to the types of Python to complain about what looks like theirs.
            raise _error(f"cannot be read as {node.tag}: {error}", node) from None
        if isinstance(value, int) and value.bit_length() > 1024:
            raise _error("no number has so many digits", node)
        return value

    @override
    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                continue  # it is refused below
            if key in seen:
                raise _error(f"the key '{key}' stands there twice", key_node)
            seen.add(key)
        return super().construct_mapping(node, deep)


def _written_out(node: yaml.Node, known: dict[yaml.Node, int], around: set[yaml.Node]) -> int:
    """Number of characters of a node with its aliases written out, give or take punctuation."""
    if node in around:
        raise _error("an alias stands within what it stands for", node)
    if node not in known:
        around.add(node)
        if isinstance(node, yaml.ScalarNode):
            parts = [len(node.value)]
        elif isinstance(node, yaml.MappingNode):
            parts = [_written_out(n, known, around) for pair in node.value for n in pair]
        else:
            parts = [_written_out(n, known, around) for n in node.value]
        around.remove(node)
        known[node] = 1 + sum(parts)
    if known[node] > LARGEST:
        raise _error(f"has more than {LARGEST} characters with all aliases written out", node)
    return known[node]


def _error(problem: str, node: yaml.Node) -> yaml.constructor.ConstructorError:
    return yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
