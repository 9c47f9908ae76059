"""The command `gameinfer check`: check that solutions are local equilibria."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.check.check_study import CheckStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Run the check that the options describe, and return the exit code."""
    return command.run(
        options, options.samples, lambda scenario: CheckStudy(scenario, options.tolerance)
    )
