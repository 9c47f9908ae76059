"""Texts of others that are too long to be shown."""

from __future__ import annotations


def shorten(text: str, length: int) -> str:
    """The text, or its beginning with dots behind it, of at most so many characters."""
    return text if len(text) <= length else f"{text[: length - 3]}..."
