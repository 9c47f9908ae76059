"""The command `gameinfer`."""

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from gameinfer_ros import __version__
from gameinfer_ros.commands.arguments.parser import Parser
from gameinfer_ros.names import ros_args
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE
from gameinfer_ros.system.load import load

#: For each subcommand, the module whose `run` does the work, and its purpose. The options are in
#: `gameinfer_ros.commands`. Modules are imported only when they are used; most need no ROS.
COMMANDS = {
    "run": ("orchestration.orchestrator", "run a scenario on ROS 2"),
    "inspect": ("bags.inspection", "show the contents of the bag of a run"),
    "replay": (
        "orchestration.replay",
        "replay a bag to the inference node, and compare its beliefs",
    ),
    "equilibria": ("experiments.equilibria.equilibria_study", "find the equilibria of a game"),
    "check": ("experiments.check.command", "check that equilibria are local"),
    "prediction": (
        "experiments.prediction.prediction_study",
        "compare predictions with and without inference",
    ),
    "planning": (
        "experiments.planning.planning_study",
        "compare robots with and without alignment",
    ),
    "report": ("experiments.report.command", "run all studies, and write a page of results"),
    "bench": ("experiments.benchmark.bench", "measure the solver and the belief on this machine"),
}

_EPILOG = """\
gameinfer COMMAND --help shows the options of a command, with examples.

exit codes: 0 done, 1 failed, 2 bad input, 130 interrupted"""


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand, and return its exit code."""
    parser = Parser(
        prog="gameinfer",
        description="Infer which equilibrium people play, and play a robot's part of it.",
        epilog=_EPILOG,
    )
    parser.add_argument(
        "-V", "--version", action="version", version=f"gameinfer {__version__}",
        help="show the version and exit",
    )  # fmt: skip
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command")
    for name, (_, purpose) in COMMANDS.items():
        command = importlib.import_module(f"gameinfer_ros.commands.{name}")
        subparser = subparsers.add_parser(
            name, help=purpose, description=command.__doc__, examples=command.EXAMPLES
        )
        command.add_arguments(subparser)
    if "_ARGCOMPLETE" in os.environ:  # a shell asks for completions; `autocomplete` exits
        from argcomplete import autocomplete
        from argcomplete.completers import SuppressCompleter

        hidden = ["-h", "--help", "-V", "--version"]
        autocomplete(parser, exclude=hidden, default_completer=SuppressCompleter())
    own, options_of_ros = ros_args.split(sys.argv[1:] if args is None else args)
    options = parser.parse_args(own, argparse.Namespace(ros_args=options_of_ros))
    if options.command is None:
        parser.print_help()
        return DONE
    if options_of_ros and options.command != "run":
        subparsers.choices[options.command].error(
            f"--ros-args is only allowed for run, not for {options.command}"
        )
    if os.environ.get("NO_COLOR"):  # the logger of ROS uses another variable
        os.environ.setdefault("RCUTILS_COLORIZED_OUTPUT", "0")
    try:
        command = load(f"gameinfer_ros.{COMMANDS[options.command][0]}")
    except OSError as error:  # for example, Matplotlib needs a folder that it can write to
        print(error, file=sys.stderr)
        return BAD_INPUT
    return int(command.run(options))
