"""`python -m gameinfer_ros.experiments.prediction` is `gameinfer prediction`."""

import sys

from gameinfer_ros.experiments.prediction import command as prediction
from gameinfer_ros.experiments.study import command

sys.exit(command.main(prediction, sys.argv[1:]))
