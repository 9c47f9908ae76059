"""Compares a robot that aligns with one that does not: the command `gameinfer planning`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.planning.planning_study import PlanningStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(
        options,
        options.runs,
        lambda scenario: PlanningStudy(scenario, options.ros, options.safety),
    )
