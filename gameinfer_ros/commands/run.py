"""Run a scenario on ROS 2: start all nodes, watch them, and stop them."""

from __future__ import annotations

import argparse

from gameinfer_ros.commands.arguments import completers, options
from gameinfer_ros.commands.arguments.completers import complete
from gameinfer_ros.commands.arguments.types import new_folder, whole_number
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
        help="let the robot do what it plans, without its safety layer",
    )  # fmt: skip
    game.add_argument(
        "--steps", type=whole_number(1, 10**8), metavar="N",
        help="length of the run; by default as the scenario says",
    )  # fmt: skip
    game.add_argument(
        "--particles", type=whole_number(1), metavar="N",
        help="particles at the start; by default as the scenario says",
    )  # fmt: skip
    nodes = parser.add_argument_group("how it is run")
    nodes.add_argument(
        "--time", default=REALTIME, choices=(LOCKSTEP, REALTIME),
        help="lockstep: every step waits for the inputs of all players, so that a seed gives the "
        "same run again; realtime: nobody waits for anybody; %(default)s by default",
    )  # fmt: skip
    nodes.add_argument(
        "--external", action="append", metavar="PLAYER",
        help="a player that somebody else moves, who tells where it is on PLAYER/odom; in realtime "
        "only, and once for each such player",
    )  # fmt: skip
    nodes.add_argument(
        "--respawn", action="store_true",
        help=f"start a node anew that has died, up to {RESPAWN_LIMIT} times in "
        f"{RESPAWN_WITHIN:.0f} s; by default, the run ends with it",
    )  # fmt: skip
    # Taken out before the rest is parsed; it stands here to be told of and completed.
    nodes.add_argument(
        "--ros-args", nargs="...", default=argparse.SUPPRESS, metavar="... --",
        help="what follows, up to -- or the end, goes to every node",
    )  # fmt: skip
    view = parser.add_argument_group("how it is watched")
    view.add_argument(
        "--view", action="store_true",
        help="show the run on a web page of this machine, and print its address",
    )  # fmt: skip
    view.add_argument(
        "--view-port", type=whole_number(0, 65535), metavar="N",
        help=f"port of the page; 0: a free one; by default {VIEW_PORT}, or a free one if that "
        "is in use",
    )  # fmt: skip
    view.add_argument("--control", action="store_true", help="let the page pause and reset the run")
    results = options.add_results(parser)
    options.add_animation(results)
    record = results.add_argument(
        "--record", type=new_folder, metavar="DIR",
        help="record all topics as a bag in this folder, which does not exist yet or is empty",
    )  # fmt: skip
    complete(record, completers.folders)
