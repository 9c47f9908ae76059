"""The command `gameinfer planning`: compare robots with and without alignment."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.planning.planning_study import PlanningStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(
        options,
        options.runs,
        lambda scenario: PlanningStudy(scenario, options.ros, options.safety),
    )
