"""The answer to a request of a page."""

from __future__ import annotations

from typing import NamedTuple


class Answer(NamedTuple):
    """The result of an action that a page requested.

    Attributes:
        success: whether the action was done.
        message: what happened, for the user.
    """

    success: bool
    message: str
