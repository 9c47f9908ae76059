"""`python -m gameinfer_ros.experiments.check` is `gameinfer check`."""

import sys

from gameinfer_ros.commands import cli

sys.exit(cli.main(["check", *sys.argv[1:]]))
