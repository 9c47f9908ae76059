"""Checks whether equilibria are local equilibria: the command `gameinfer check`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.check.check_study import CheckStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Conduct the check as the options say; returns the exit code."""
    return command.run(
        options, options.samples, lambda scenario: CheckStudy(scenario, options.tolerance)
    )
