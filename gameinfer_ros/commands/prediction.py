"""Compare predictions of the players' positions with and without inference.

To resume an interrupted study, repeat the command with the same --out.
"""

import argparse

from gameinfer_ros.commands.arguments import options

EXAMPLES = ("gameinfer prediction", "gameinfer prediction --runs 20 --jobs 2 --json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    options.add_study(parser, options.add_runs)
