"""The error for invalid messages, and checks that raise it."""

from collections.abc import Sequence

import numpy as np

#: Largest magnitude of a number in a message. Even its sixth power does not overflow.
LARGEST = 1e12


class MessageError(ValueError):
    """A message is invalid. The text names the field, its value and what is allowed."""


def check_equal(field: str, value: object, expected: object) -> None:
    """Raise `MessageError` unless a field has the expected value."""
    if value != expected:
        raise MessageError(f"{field}: {value!r} is not allowed: {expected!r} is expected")


def check_length(field: str, values: Sequence[object], expected: int) -> None:
    """Raise `MessageError` unless an array has the expected length."""
    if len(values) != expected:
        raise MessageError(f"{field}: has {len(values)} items; {expected} are expected")


def check_finite(field: str, values: np.ndarray) -> None:
    """Raise `MessageError` unless all numbers are finite and at most `LARGEST` in magnitude."""
    good = np.abs(values) <= LARGEST  # False for NaN
    if not good.all():
        position = np.unravel_index(np.argmin(good), np.shape(values))
        value = values[position]
        allowed = "a finite number"
        if np.isfinite(value):
            allowed = f"allowed: it must be from {-LARGEST:g} to {LARGEST:g}"
        raise MessageError(f"{field}{[int(p) for p in position]}: {value} is not {allowed}")


def check_whole(field: str, values: np.ndarray, lowest: int = 0) -> None:
    """Raise `MessageError` unless all numbers (K,) are whole numbers of at least `lowest`."""
    # Beyond 2^53, a float cannot represent every whole number.
    good = (values >= lowest) & (values <= 2**53) & (values == np.round(values))
    if not good.all():
        wrong = values[np.argmin(good)]
        raise MessageError(
            f"{field}: {wrong} is not allowed: it must be a whole number from {lowest} to {2**53}"
        )
