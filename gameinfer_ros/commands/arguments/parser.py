"""A parser of command lines that suggests corrections."""

import argparse
from collections.abc import Sequence
from typing import Any

from typing_extensions import override

from gameinfer_ros.names.text import did_you_mean


class Parser(argparse.ArgumentParser):
    """An argument parser that suggests the nearest option or choice for a mistyped one.

    Options cannot be abbreviated, because a new option could make an abbreviation ambiguous. The
    help ends with the `examples`.
    """

    def __init__(self, *, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(
            allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, **options
        )
        if examples:
            self.epilog = "\n  ".join(["examples:", *examples])

    # typeshed declares five overloads; this signature covers them all.
    @override
    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:  # argparse would report them later, with the usage of `gameinfer`
            known = [name for action in self._actions for name in action.option_strings]
            hint = did_you_mean(unknown[0].partition("=")[0], known)
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return options, unknown

    @override
    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            hint = did_you_mean(value, action.choices)
            raise argparse.ArgumentError(
                action,
                f"'{value}' is not allowed: it must be one of {', '.join(action.choices)}{hint}",
            )
