"""Compare a robot that aligns with the people to one that does not.

The same command with the --out of one that was interrupted goes on with it.
"""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = (
    "gameinfer planning --scenario five_player --out results/five",
    "gameinfer planning --runs 20 --backend dask --scheduler tcp://127.0.0.1:8786",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    game = options.add_game(parser)
    options.add_runs(game)
    options.add_seed(game)
    game.add_argument(
        "--safety", action="store_true",
        help="give the robot its safety layer, which the paper has not",
    )  # fmt: skip
    workers = options.add_workers(parser)
    workers.add_argument(
        "--ros", action="store_true",
        help="make the runs by the ROS 2 nodes in lockstep; the results are the same",
    )  # fmt: skip
    options.add_results(parser)
