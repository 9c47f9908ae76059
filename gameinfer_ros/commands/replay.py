"""Play the states of a bag to the inference, and compare beliefs to the recorded.

Exits with 0 if all are the same to the last bit, and with 1 if not.
"""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer replay bags/first", "gameinfer replay bags/first --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a replay."""
    options.add_bag(parser)
    options.add_json(parser.add_argument_group("results"))
