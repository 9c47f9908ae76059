"""The command `gameinfer prediction`: compare predictions with and without inference."""

from __future__ import annotations

import argparse

from gameinfer_ros.experiments.prediction.prediction_study import PredictionStudy
from gameinfer_ros.experiments.study import command


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(options, options.runs, PredictionStudy)
