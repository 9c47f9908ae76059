"""`python -m gameinfer_ros.experiments.equilibria` is `gameinfer equilibria`."""

import sys

from gameinfer_ros.commands import cli

sys.exit(cli.main(["equilibria", *sys.argv[1:]]))
