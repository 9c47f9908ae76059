"""A parser of command lines that says what may have been meant."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Iterable, Sequence
from typing import Any

from typing_extensions import override


class Parser(argparse.ArgumentParser):
    """Names the nearest option or choice where one is mistyped, under the subcommand's own usage.

    Options must be spelled out: what is short for one option today may be short for two tomorrow.

    Args:
        examples: command lines to be shown at the end of the help.
        options: passed on to `argparse.ArgumentParser`.
    """

    def __init__(self, *, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(
            allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, **options
        )
        if examples:
            self.epilog = "\n  ".join(["examples:", *examples])

    # The types of the standard library tell five cases apart; all of them come to this.
    @override
    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:  # argparse would complain only later, and under the usage of `gameinfer`
            known = [name for action in self._actions for name in action.option_strings]
            hint = _nearest(unknown[0].partition("=")[0], known)
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return options, unknown

    @override
    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            hint = _nearest(value, action.choices)
            raise argparse.ArgumentError(
                action,
                f"'{value}' is not allowed: it must be one of {', '.join(action.choices)}{hint}",
            )


def _nearest(word: str, known: Iterable[str]) -> str:
    """A question about what was meant, or nothing if nothing is near."""
    return "".join(f"; did you mean {name}?" for name in difflib.get_close_matches(word, known, 1))
