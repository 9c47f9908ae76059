"""Run a scenario on ROS 2: start all nodes, monitor them, and stop them."""

import argparse

from gameinfer_ros.commands.arguments import completers, options
from gameinfer_ros.commands.arguments.completers import complete
from gameinfer_ros.commands.arguments.types import folder, whole_number
from gameinfer_ros.names.choices import LOCKSTEP, MAP, REALTIME
from gameinfer_ros.names.defaults import RESPAWN_LIMIT, RESPAWN_WITHIN, VIEW_PORT
from gameinfer_ros.names.planners import planners

EXAMPLES = (
    "gameinfer run --scenario two_player --planner baseline --seed 4",
    "gameinfer run --time lockstep --seed 3 --record bags/first --json",
    "gameinfer run --view --control",
    "gameinfer run --external human_1 --ros-args -r __ns:=/demo",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a run."""
    game = options.add_game(parser)
    game.add_argument(
        "--planner", default=MAP, choices=planners(),
        help="; ".join(f"{name}: {purpose.lower()}" for name, purpose in planners().items())
        + "; %(default)s by default",
    )  # fmt: skip
    options.add_seed(game)
    game.add_argument(
        "--no-safety", action="store_true",
        help="turn the safety layer of the robot off",
    )  # fmt: skip
    game.add_argument(
        "--steps", type=whole_number(1, 10**8), metavar="N",
        help="number of steps of the run; that of the scenario by default",
    )  # fmt: skip
    game.add_argument(
        "--particles", type=whole_number(1), metavar="N",
        help="initial number of particles; that of the scenario by default",
    )  # fmt: skip
    nodes = parser.add_argument_group("nodes")
    nodes.add_argument(
        "--time", default=REALTIME, choices=(LOCKSTEP, REALTIME),
        help="lockstep: each step waits for the inputs of all players, so that a seed always gives "
        "the same run; realtime: steps follow the clock and never wait; %(default)s by default",
    )  # fmt: skip
    nodes.add_argument(
        "--external", action="append", metavar="PLAYER",
        help="a player that is moved outside of the simulation and reports its odometry on "
        "PLAYER/odom; only in realtime; repeat the option for several players",
    )  # fmt: skip
    nodes.add_argument(
        "--respawn", action="store_true",
        help=f"restart a node that died, up to {RESPAWN_LIMIT} times in {RESPAWN_WITHIN:.0f} s; "
        "by default, the run ends with the node",
    )  # fmt: skip
    # Removed before the rest is parsed; added here for the help and for completion.
    nodes.add_argument(
        "--ros-args", nargs="...", default=argparse.SUPPRESS, metavar="... --",
        help="pass the following arguments, up to -- or the end, to every node",
    )  # fmt: skip
    view = parser.add_argument_group("live page")
    view.add_argument(
        "--view", action="store_true",
        help="show the run on a web page on this machine, and print its address",
    )  # fmt: skip
    view.add_argument(
        "--view-port", type=whole_number(0, 65535), metavar="N",
        help=f"port of the page, 0 for any free port; {VIEW_PORT} by default, or any free port if "
        "it is in use",
    )  # fmt: skip
    view.add_argument(
        "--control", action="store_true", help="allow the page to pause and reset the run"
    )
    results = options.add_results(parser)
    options.add_animation(results)
    record = results.add_argument(
        "--record", type=folder, metavar="DIR",
        help="record all topics as a bag in this folder, which must be new or empty, or contain a "
        "bag with --overwrite",
    )  # fmt: skip
    complete(record, completers.folders)
