"""Compares a robot that aligns with one that does not: the command `gameinfer planning`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.planning.planning_study import PlanningStudy
from gameinfer_ros.experiments.study import command


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    command.add_scenario(parser, "three_player")
    command.add_count(parser, "--runs", 200, "runs with each planner")
    parser.add_argument(
        "--ros", action="store_true",
        help="make the runs by the ROS 2 nodes in lockstep; the results are the same",
    )  # fmt: skip
    command.add_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(options, lambda scenario: PlanningStudy(scenario, options.ros))
