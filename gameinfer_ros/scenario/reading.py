"""Reads YAML 1.2 from untrusted files."""

import re
from pathlib import Path
from typing import Any, ClassVar

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer, ComposerError
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode
from ruamel.yaml.resolver import VersionedResolver
from typing_extensions import override

from gameinfer_ros.names.text import shorten
from gameinfer_ros.scenario.files import ScenarioError

#: Largest size of a file in bytes, and of its content in characters with all aliases expanded.
LARGEST = 2**18

#: Most levels of nested lists and mappings.
DEEPEST = 64

#: How plain scalars are resolved: the core schema of YAML 1.2, and merge keys. Others are strings.
_SCALARS = {
    "null": r"(null|Null|NULL|~|)\Z",
    "bool": r"(true|True|TRUE|false|False|FALSE)\Z",
    # Longer numbers would not fit a float.
    "int": r"([-+]?[0-9]{1,300}|0o[0-7]{1,300}|0x[0-9a-fA-F]{1,250})\Z",
    "float": r"([-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
    r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))\Z",
    "merge": r"<<\Z",
}


def load(path: Path) -> Any:
    """Read the content of a YAML file.

    Raises:
        ScenarioError: the file cannot be read, is not valid, or is too large. The message names
            the line and the column.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from None
    if len(data) > LARGEST:
        raise ScenarioError(f"{path}: is too large: at most {LARGEST} bytes are allowed")
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer, yaml.Resolver = _Composer, _Resolver
    try:
        return yaml.load(data.decode("utf-8"))
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = ", ".join(text for text in (error.context, error.problem) if text)
        where = f"{path}: line {mark.line + 1}, column {mark.column + 1}"
        raise ScenarioError(f"{where}: cannot be read as YAML: {shorten(what, 500)}") from None
    except Exception as error:  # ruamel.yaml lets some built-in exceptions through
        what = " ".join(str(error).split())
        raise ScenarioError(f"{path}: cannot be read as YAML: {shorten(what, 500)}") from None


def meant_number(text: str) -> str | None:
    """Return how to write the number that a text looks like; None if it does not look like one.

    Such texts are numbers in quotes or with a decimal comma, and numbers of YAML 1.1: with
    underscores, in base 2, or in base 60 (`1:30` is 90).
    """
    if re.fullmatch(_SCALARS["int"], text) or re.fullmatch(_SCALARS["float"], text):
        return text
    if re.fullmatch(r"[-+]?[0-9]+,[0-9]+", text):
        return text.replace(",", ".")
    if re.fullmatch(r"[-+]?[0-9][0-9_]*(\.[0-9_]*)?", text):
        return text.replace("_", "")
    if re.fullmatch(r"[-+]?0b[01]{1,60}", text):
        return str(int(text, 2))
    if re.fullmatch(r"[0-9]{1,9}(:[0-5]?[0-9]){1,2}", text):
        value = 0
        for digits in text.split(":"):
            value = 60 * value + int(digits)
        return str(value)
    return None


class _Resolver(VersionedResolver):
    """Resolves plain scalars by `_SCALARS`, whatever version the file declares."""

    processing_version = (1, 2)
    versioned_resolver: ClassVar[dict[None, list[tuple[str, re.Pattern[str]]]]] = {
        None: [(f"tag:yaml.org,2002:{name}", re.compile(p)) for name, p in _SCALARS.items()]
    }


class _Composer(Composer):
    """Refuses tags, deep nesting, duplicate keys and aliases that expand too much."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.warn_double_anchors = False
        self._levels = 0
        self._sizes: dict[Node, int] = {}

    @override
    def compose_node(self, parent: Node | None, index: Any) -> Node:
        event = self.parser.peek_event()
        is_alias = isinstance(event, AliasEvent)
        if not is_alias and event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise _error(f"the tag {tag} is not allowed: write the value without a tag", event)
        self._levels += 1
        if self._levels > DEEPEST:
            raise _error(f"lists and mappings are nested deeper than {DEEPEST} levels", event)
        node = super().compose_node(parent, index)
        self._levels -= 1
        if node not in self._sizes:
            if is_alias:
                raise _error(f"the alias *{event.anchor} refers to a value that contains it", event)
            self._sizes[node] = self._size(node)
        if self._sizes[node] > LARGEST:
            raise _error(f"has more than {LARGEST} characters with all aliases expanded", event)
        return node

    def _size(self, node: Node) -> int:
        """Count the characters of a node with all aliases expanded, and one for each node."""
        if isinstance(node, ScalarNode):
            return 1 + len(node.value)
        if isinstance(node, MappingNode):
            _check_keys([key for key, _ in node.value])
            return 1 + sum(self._sizes[child] for pair in node.value for child in pair)
        return 1 + sum(self._sizes[child] for child in node.value)


def _check_keys(keys: list[Node]) -> None:
    lines: dict[str, int] = {}
    for key in keys:
        if not isinstance(key, ScalarNode):
            raise _error("a key must be text, not a list or a mapping", key)
        if str(key.tag).rpartition(":")[2] not in ("str", "merge"):
            raise _error(f"the key {key.value or 'null'} is not text: write it in quotes", key)
        if key.value in lines:
            raise _error(f"duplicate key {key.value!r}: it is in line {lines[key.value]} too", key)
        lines[key.value] = key.start_mark.line + 1


def _error(problem: str, place: Any) -> ComposerError:
    return ComposerError(None, None, problem, place.start_mark)
