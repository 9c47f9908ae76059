"""`python -m gameinfer_ros` is the command `gameinfer`."""

# PYTHON_ARGCOMPLETE_OK
import sys

from gameinfer_ros.commands.gameinfer import command

sys.exit(command())
