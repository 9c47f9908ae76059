"""YAML of the content of files, and back."""

from __future__ import annotations

from io import StringIO
from typing import Any

from ruamel.yaml import YAML


def dump(content: Any) -> str:
    """YAML of some content, with keys in their order."""
    yaml = YAML(typ="safe", pure=True)
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def load(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)
