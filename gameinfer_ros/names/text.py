"""Formatting of text and JSON."""

import difflib
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any


def json_text(figures: Any, indent: int | None = None) -> str:
    """Return `figures` as JSON, with null for numbers that are not finite."""
    try:
        return json.dumps(figures, indent=indent, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(figures), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return value


def shorten(text: str, length: int) -> str:
    """Return `text`, cut to at most `length` characters; three dots mark a cut."""
    return text if len(text) <= length else f"{text[: length - 3]}..."


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return a suggestion of the nearest known word, or an empty string if none is near."""
    return "".join(f"; did you mean {name}?" for name in difflib.get_close_matches(word, known, 1))
