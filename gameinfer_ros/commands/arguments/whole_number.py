"""Numbers on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def whole_number(lowest: int, highest: int = 10**6) -> Callable[[str], int]:
    """A type for argparse: whole numbers from `lowest` to `highest`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = lowest - 1
        if not lowest <= value <= highest:
            shown = text if len(text) <= 80 else f"{text[:77]}..."
            raise argparse.ArgumentTypeError(
                f"'{shown}' is not allowed: it must be a whole number, {lowest} or above, "
                f"and at most {highest}"
            )
        return value

    return parse
