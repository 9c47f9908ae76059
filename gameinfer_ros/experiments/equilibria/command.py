"""Finds the equilibria of a game: the command `gameinfer equilibria`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(
        options, options.samples, lambda scenario: EquilibriaStudy(scenario, options.k_means)
    )
