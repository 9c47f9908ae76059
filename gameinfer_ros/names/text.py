"""Text for readers and for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def json_text(figures: Any, indent: int | None = None) -> str:
    """JSON of figures; null stands for numbers that are not finite, of which JSON knows none."""
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
    """The text, or its beginning with dots behind it, of at most so many characters."""
    return text if len(text) <= length else f"{text[: length - 3]}..."
