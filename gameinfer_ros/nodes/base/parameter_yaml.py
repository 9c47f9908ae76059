"""Values of parameters in YAML, as ROS reads them."""

import re

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import Node, ScalarNode, SequenceNode

#: The types of scalars.
INTEGER, TEXT = "an integer", "text"

#: Styles of scalars that are always text.
_QUOTES = "'", '"'

#: How ROS reads other scalars, which is nearly YAML 1.1. The rest is text.
_TYPES = {
    "a boolean": r"[Yy]|yes|Yes|YES|[Nn]|no|No|NO|true|True|TRUE|false|False|FALSE"
    r"|on|On|ON|off|Off|OFF",
    INTEGER: r"[-+]?([1-9][0-9]*|0[0-7]*|0[xX][0-9a-fA-F]+)",
    "a double": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)"
    r"|\.(nan|NaN|NAN)",
}

#: What to write instead of a missing value.
_NO_VALUE = "has no value: write one, such as '' for an empty text"


def read(text: str) -> ScalarNode | SequenceNode:
    """Read a value as in `-p NAME:=VALUE`.

    Raises:
        ValueError: ROS cannot read it. The message says why.
    """
    try:
        value = YAML(typ="safe", pure=True).compose(text)
    except MarkedYAMLError as error:
        raise ValueError(f"cannot be read as YAML: {error.problem}: write text in quotes") from None
    except (YAMLError, RecursionError) as error:
        what = " ".join(str(error).split())
        raise ValueError(f"cannot be read as YAML: {what}") from None
    why = complaint(value)
    if why:
        raise ValueError(why)
    assert isinstance(value, ScalarNode | SequenceNode)  # of all others, there is a complaint
    return value


def complaint(value: Node | None) -> str:
    """Why ROS cannot read a value, or reads only a part of it; empty if it reads all of it."""
    if isinstance(value, SequenceNode):
        if not all(isinstance(item, ScalarNode) for item in value.value):
            return "is a list of lists or mappings, but ROS only reads lists of single values"
        whys = filter(None, map(complaint, value.value))
        types = list(dict.fromkeys(map(type_of, value.value)))
        if len(types) > 1:
            return (
                f"is a list of different types, {types[0]} and {types[1]}: write values of one "
                "type, text in quotes"
            )
        return next(whys, "")
    if not isinstance(value, ScalarNode):
        return _NO_VALUE if value is None else "is a mapping: write a single value or a list"
    return "" if value.value or value.style in _QUOTES else _NO_VALUE


def type_of(value: ScalarNode | SequenceNode) -> str:
    """Type of the parameter that ROS makes of a value, in words."""
    if isinstance(value, SequenceNode):
        return "a list"
    if value.style not in _QUOTES:
        for name, pattern in _TYPES.items():
            if re.fullmatch(pattern, value.value):
                return name
    return TEXT
