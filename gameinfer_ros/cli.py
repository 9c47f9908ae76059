"""The command `gameinfer`."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

from gameinfer_ros import ros_args

#: For each subcommand, its module and what it does. Only that of the subcommand that is run is
#: imported: most of them need no ROS.
COMMANDS = {
    "run": ("orchestrator", "run a scenario on ROS 2"),
    "inspect": ("inspection", "tell what a bag of a run holds"),
    "replay": ("replay", "play the states of a bag to the inference, and compare its beliefs"),
    "equilibria": ("experiments.equilibria.command", "find the equilibria of a game"),
    "prediction": ("experiments.prediction.command", "compare predictions of what people will do"),
    "planning": (
        "experiments.planning.command",
        "compare a robot that aligns to one that does not",
    ),
    "report": ("experiments.report.command", "conduct all studies, and write a page about them"),
    "bench": ("experiments.benchmark.bench", "measure how fast games are solved on this machine"),
}


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns its exit code."""
    own, options_of_ros = ros_args.split(sys.argv[1:] if args is None else args)
    parser = argparse.ArgumentParser(prog="gameinfer", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, (module_name, purpose) in COMMANDS.items():
        command = commands.add_parser(name, help=purpose)
        if name in own[:1]:
            module = importlib.import_module(f"gameinfer_ros.{module_name}")
            command.description = module.__doc__
            module.add_arguments(command)
            command.set_defaults(run=module.run)
    options = parser.parse_args(own, argparse.Namespace(ros_args=options_of_ros))
    if options_of_ros and own[0] != "run":
        parser.error(f"--ros-args are for run only, and not for {own[0]}")
    return int(options.run(options))


if __name__ == "__main__":
    sys.exit(main())
