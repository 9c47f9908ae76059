"""Run all studies of the paper, and write a page with their results.

To resume an interrupted report, repeat the command with the same --out.
"""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer report --out results/all", "gameinfer report --runs 6 --samples 96")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the report."""
    game = parser.add_argument_group(options.RUNS)
    options.add_samples(game)
    options.add_runs(game)
    options.add_seed(game)
    options.add_workers(parser)
    options.add_results(parser)
