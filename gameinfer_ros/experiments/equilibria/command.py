"""Finds the equilibria of a game: the command `gameinfer equilibria`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import command
from gameinfer_ros.whole_number import whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    command.add_scenario(parser, "three_player")
    command.add_count(parser, "--samples", 256, "seeds to solve the game from")
    parser.add_argument(
        "--k-means", type=whole_number(1), metavar="K",
        help="sort equilibria into K clusters by k-means, instead of finding how many there are",
    )  # fmt: skip
    command.add_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(options, lambda scenario: EquilibriaStudy(scenario, options.k_means))
