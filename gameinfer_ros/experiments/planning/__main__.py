"""`python -m gameinfer_ros.experiments.planning` is `gameinfer planning`."""

import sys

from gameinfer_ros.experiments.planning import command as planning
from gameinfer_ros.experiments.study import command

sys.exit(command.main(planning, sys.argv[1:]))
