"""Measure what this machine makes of the solver and the belief; needs no ROS."""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer bench", "gameinfer bench --quick --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a benchmark."""
    parser.add_argument(
        "--quick", action="store_true", help="a small version, to see that everything works"
    )
    options.add_results(parser)
