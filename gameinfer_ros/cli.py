"""The command `gameinfer`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from gameinfer_ros import orchestrator
from gameinfer_ros.experiments.benchmark import bench


def main(args: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns its exit code."""
    parser = argparse.ArgumentParser(prog="gameinfer", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run = commands.add_parser("run", help="run a scenario on ROS 2")
    orchestrator.add_arguments(run)
    run.set_defaults(run=orchestrator.run)
    measure = commands.add_parser("bench", help="measure how fast games are solved on this machine")
    bench.add_arguments(measure)
    measure.set_defaults(run=bench.run)
    options = orchestrator.parse(parser, sys.argv[1:] if args is None else args)
    return int(options.run(options))


if __name__ == "__main__":
    sys.exit(main())
