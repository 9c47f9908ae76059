"""The error for messages that cannot be used."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: No number in a message may be larger: of this one even the sixth power does not overflow.
LARGEST = 1e12


class MessageError(ValueError):
    """A message is malformed; says which field, its value, and what is allowed."""


def check_names(field: str, names: Sequence[str], expected: Sequence[str]) -> None:
    """Check that a message speaks of the expected joints, in order.

    Raises:
        MessageError: it does not.
    """
    if list(names) != list(expected):
        raise MessageError(f"{field}: {list(names)} is not allowed: {list(expected)} is expected")


def check_length(field: str, values: Sequence[object], expected: int) -> None:
    """Check the length of an array.

    Raises:
        MessageError: it is another.
    """
    if len(values) != expected:
        raise MessageError(f"{field}: has {len(values)} items; {expected} are expected")


def check_finite(field: str, values: np.ndarray) -> None:
    """Check that all numbers are finite, and that one can calculate with them.

    Raises:
        MessageError: one is not, or it is beyond `LARGEST`.
    """
    good = np.abs(values) <= LARGEST  # not if it is NaN
    if not good.all():
        position = np.unravel_index(np.argmin(good), np.shape(values))
        value = values[position]
        allowed = "a finite number"
        if np.isfinite(value):
            allowed = f"allowed: it must be from {-LARGEST:g} to {LARGEST:g}"
        raise MessageError(f"{field}{[int(p) for p in position]}: {value} is not {allowed}")


def check_whole(field: str, values: np.ndarray, lowest: int = 0) -> None:
    """Check that all numbers (K,) are whole numbers from `lowest` on.

    Raises:
        MessageError: one is not.
    """
    # Beyond 2^53 a float no longer tells a whole number from the next.
    good = (values >= lowest) & (values <= 2**53) & (values == np.round(values))
    if not good.all():
        wrong = values[np.argmin(good)]
        raise MessageError(
            f"{field}: {wrong} is not allowed: it is a whole number from {lowest} on"
        )


def check_frame(frame_id: str, expected: str) -> None:
    """Check the frame that a message is given in.

    Raises:
        MessageError: it is another.
    """
    if frame_id != expected:
        raise MessageError(
            f"header.frame_id: '{frame_id}' is not allowed: '{expected}' is expected"
        )
