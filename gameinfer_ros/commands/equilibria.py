"""Find the equilibria of a game: solve it from many seeds, cluster the results.

To resume an interrupted study, repeat the command with the same --out.
"""

import argparse

from gameinfer_ros.commands.arguments import options
from gameinfer_ros.commands.arguments.types import whole_number

EXAMPLES = (
    "gameinfer equilibria --scenario two_player",
    "gameinfer equilibria --samples 96 --k-means 8 --json",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    _, _, results = options.add_study(parser, options.add_samples)
    results.add_argument(
        "--k-means", type=whole_number(1), metavar="K",
        help="find K clusters by k-means; by default, the number of clusters is determined "
        "automatically",
    )  # fmt: skip
