"""Compares predictions of what people will do: the command `gameinfer prediction`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.prediction.prediction_study import PredictionStudy
from gameinfer_ros.experiments.study import command


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the study."""
    command.add_scenario(parser, "three_player")
    command.add_count(parser, "--runs", 200, "runs that each predictor watches")
    command.add_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(options, PredictionStudy)
