"""Check that equilibria are local: that no player gains by deviating alone.

Sample k is the one of gameinfer equilibria. The exit code is 1 if a player
gains more than the tolerance in an equilibrium, if no sample converged, or if
more than 1 % of the searches for a gain gave up. To resume an interrupted
check, repeat the command with the same --out. With --suite, the check runs
on every standard game, each in a folder of its own below --out.
"""

import argparse

from gameinfer_ros.commands.arguments import options, types

EXAMPLES = (
    "gameinfer check --scenario two_player",
    "gameinfer check --samples 32 --tolerance 0.005 --json",
    "gameinfer check --suite --samples 16 --method newton",
)

#: Those of the settings of the solver.
METHODS = ("iterative_lq", "newton")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the check."""
    game, _, _ = options.add_study(parser, options.add_samples, suite=True)
    game.add_argument(
        "--method", choices=METHODS,
        help="method of the solver; by default, that of the scenario",
    )  # fmt: skip
    game.add_argument(
        "--tolerance", type=types.share, default=0.01, metavar="SHARE",
        help="largest gain that an equilibrium may leave a player, as a share of the player's "
        "cost; %(default)s by default",
    )  # fmt: skip
