"""Compare predictions of what people will do: by inference, and without.

The same command with the --out of one that was interrupted goes on with it.
"""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer prediction", "gameinfer prediction --runs 20 --jobs 2 --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    game = options.add_game(parser)
    options.add_runs(game)
    options.add_seed(game)
    options.add_workers(parser)
    options.add_results(parser)
