"""Compare the costs of a robot that aligns with people and of one that does not.

To resume an interrupted study, repeat the command with the same --out.
"""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = (
    "gameinfer planning --scenario five_player --out results/five",
    "gameinfer planning --runs 20 --backend dask --scheduler tcp://127.0.0.1:8786",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    game, workers, _ = options.add_study(parser, options.add_runs)
    game.add_argument(
        "--safety", action="store_true",
        help="add the safety layer of the robot, which the paper does not have",
    )  # fmt: skip
    workers.add_argument(
        "--ros", action="store_true",
        help="play the runs with the ROS 2 nodes in lockstep; the results are the same",
    )  # fmt: skip
