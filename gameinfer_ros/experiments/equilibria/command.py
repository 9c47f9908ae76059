"""The command `gameinfer equilibria`: find the equilibria of a game."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(
        options, options.samples, lambda scenario: EquilibriaStudy(scenario, options.k_means)
    )
