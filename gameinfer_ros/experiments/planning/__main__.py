"""`python -m gameinfer_ros.experiments.planning` is `gameinfer planning`."""

import sys

from gameinfer_ros.commands import cli

sys.exit(cli.main(["planning", *sys.argv[1:]]))
