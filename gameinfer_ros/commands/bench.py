"""Measure the speed and memory of the solver and the belief; needs no ROS."""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer bench", "gameinfer bench --quick --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the benchmark."""
    parser.add_argument(
        "--quick", action="store_true", help="run a small version, to check that everything works"
    )
    options.add_results(parser)
