"""Check whether equilibria are local ones: whether players could do better.

Sample k is that of gameinfer equilibria. The exit code is 1 if an equilibrium
is above the tolerance, if none converged, or if more than 1 % of the searches
gave up. The same command with the --out of one that was interrupted goes on
with it.
"""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import options, types

EXAMPLES = (
    "gameinfer check --scenario two_player",
    "gameinfer check --samples 32 --tolerance 0.005 --json",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the check."""
    game = options.add_game(parser)
    options.add_samples(game)
    options.add_seed(game)
    game.add_argument(
        "--tolerance", type=types.share, default=0.01, metavar="SHARE",
        help="what an equilibrium may leave a player to gain, as a share of its cost; "
        "%(default)s by default",
    )  # fmt: skip
    options.add_workers(parser)
    options.add_results(parser)
