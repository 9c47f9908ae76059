"""How many examples a property is tried on."""

from __future__ import annotations

#: Whether that is all of them; the option `--thorough` sets it before any test is imported.
thorough = False


def examples(number: int) -> int:
    """A quarter of the examples, unless these tests are thorough."""
    return number if thorough else -(-number // 4)
