"""`python -m gameinfer_ros.experiments.report` is `gameinfer report`."""

import sys

from gameinfer_ros.commands import cli

sys.exit(cli.main(["report", *sys.argv[1:]]))
