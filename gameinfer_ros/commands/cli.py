"""The command `gameinfer`."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from gameinfer_ros import __version__
from gameinfer_ros.commands.arguments import ros_args
from gameinfer_ros.commands.arguments.parser import Parser
from gameinfer_ros.names.exit_codes import DONE, INTERRUPTED
from gameinfer_ros.system.load import load

#: For each subcommand, the module whose `run` does the work, and what it does. Its options are in
#: `gameinfer_ros.commands`. The work is imported when it is to be done: most of it needs no ROS.
COMMANDS = {
    "run": ("orchestration.orchestrator", "run a scenario on ROS 2"),
    "inspect": ("bags.inspection", "tell what a bag of a run holds"),
    "replay": ("orchestration.replay", "play a bag to the inference, and compare its beliefs"),
    "equilibria": ("experiments.equilibria.command", "find the equilibria of a game"),
    "check": ("experiments.check.command", "check whether they are local equilibria"),
    "prediction": ("experiments.prediction.command", "compare predictions of what people will do"),
    "planning": (
        "experiments.planning.command",
        "compare a robot that aligns to one that does not",
    ),
    "report": ("experiments.report.command", "conduct all studies, and write a page about them"),
    "bench": ("experiments.benchmark.bench", "measure how fast games are solved on this machine"),
}

_EPILOG = """\
gameinfer COMMAND --help tells the options of a command, with examples.

exit codes: 0 done, 1 failed, 2 bad input, 130 interrupted"""


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns its exit code."""
    try:
        return _run(sys.argv[1:] if args is None else args)
    except KeyboardInterrupt:
        return INTERRUPTED


def _run(args: Sequence[str]) -> int:
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
    if "_ARGCOMPLETE" in os.environ:  # a shell wants to know how to go on: tell it, and exit
        from argcomplete import autocomplete
        from argcomplete.completers import SuppressCompleter

        hidden = ["-h", "--help", "-V", "--version"]
        autocomplete(parser, exclude=hidden, default_completer=SuppressCompleter())
    own, options_of_ros = ros_args.split(args)
    options = parser.parse_args(own, argparse.Namespace(ros_args=options_of_ros))
    if options.command is None:
        parser.print_help()
        return DONE
    if options_of_ros and options.command != "run":
        subparsers.choices[options.command].error(
            f"--ros-args are for run only, and not for {options.command}"
        )
    if os.environ.get(
        "NO_COLOR"
    ):  # of the libraries, the logger of ROS has a name of its own for it
        os.environ.setdefault("RCUTILS_COLORIZED_OUTPUT", "0")
    return int(load(f"gameinfer_ros.{COMMANDS[options.command][0]}").run(options))
