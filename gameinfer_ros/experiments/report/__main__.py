"""`python -m gameinfer_ros.experiments.report` is `gameinfer report`."""

import sys

from gameinfer_ros.experiments.report import command as report
from gameinfer_ros.experiments.study import command

sys.exit(command.main(report, sys.argv[1:]))
