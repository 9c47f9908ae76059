"""Compares predictions of what people will do: the command `gameinfer prediction`."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.prediction.prediction_study import PredictionStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Conduct the study as the options say; returns the exit code."""
    return command.run(options, options.runs, PredictionStudy)
