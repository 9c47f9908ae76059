"""Replay the states of a bag to the inference node, and compare its beliefs.

The exit code is 0 if all beliefs equal the recorded ones to the last bit, and 1
otherwise.
"""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer replay bags/first", "gameinfer replay bags/first --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the replay."""
    options.add_bag(parser)
    options.add_json(parser.add_argument_group("results"))
