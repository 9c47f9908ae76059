"""What came of something that a page asked for."""

from __future__ import annotations

from typing import NamedTuple


class Answer(NamedTuple):
    """Whether something was done.

    Attributes:
        success: whether it was.
        message: in words.
    """

    success: bool
    message: str
