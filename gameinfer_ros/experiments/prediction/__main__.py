"""`python -m gameinfer_ros.experiments.prediction` is `gameinfer prediction`."""

import sys

from gameinfer_ros.commands import cli

sys.exit(cli.main(["prediction", *sys.argv[1:]]))
