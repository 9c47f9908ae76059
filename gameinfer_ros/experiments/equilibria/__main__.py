"""`python -m gameinfer_ros.experiments.equilibria` is `gameinfer equilibria`."""

import sys

from gameinfer_ros.experiments.equilibria import command as equilibria
from gameinfer_ros.experiments.study import command

sys.exit(command.main(equilibria, sys.argv[1:]))
