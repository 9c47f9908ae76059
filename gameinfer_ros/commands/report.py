"""Conduct all studies, and write a page about them.

The same command with the --out of one that was interrupted goes on with it.
"""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer report --out results/all", "gameinfer report --runs 6 --samples 96")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the report."""
    game = parser.add_argument_group("what is played")
    options.add_samples(game)
    options.add_runs(game)
    options.add_seed(game)
    options.add_workers(parser)
    options.add_results(parser)
