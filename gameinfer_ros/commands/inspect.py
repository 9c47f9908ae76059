"""Show the contents of the bag of a run; needs no ROS."""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = (
    "gameinfer inspect bags/first --animation first.gif",
    "gameinfer inspect bags/first --json",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the inspection."""
    options.add_bag(parser)
    results = parser.add_argument_group("results")
    options.add_animation(results)
    options.add_json(results)
