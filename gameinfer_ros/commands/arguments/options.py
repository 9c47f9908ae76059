"""Options of several subcommands, with the same meaning and help in each."""

import argparse
from collections.abc import Callable
from typing import TypeAlias

from gameinfer_ros.commands.arguments import completers
from gameinfer_ros.commands.arguments.completers import complete
from gameinfer_ros.commands.arguments.types import animation_file, folder, whole_number
from gameinfer_ros.names.choices import DASK, PROCESSES

#: Heading of the group of options that describe the runs.
RUNS = "runs"

#: A group of options with a heading in the help.
Group: TypeAlias = argparse._ArgumentGroup


def add_bag(parser: argparse.ArgumentParser) -> None:
    """Add the folder of a bag to read."""
    bag = parser.add_argument_group("input").add_argument(
        "bag", type=folder, metavar="DIR", help="bag written by gameinfer run --record DIR"
    )
    complete(bag, completers.bags)


def add_game(parser: argparse.ArgumentParser, *, suite: bool = False) -> Group:
    """Add the group of options that describe the runs, with `--scenario` or `--suite` in it."""
    group = parser.add_argument_group(RUNS)
    game = group.add_mutually_exclusive_group()
    scenario = game.add_argument(
        "--scenario", default="three_player", metavar="NAME-or-FILE",
        help="name of a scenario of the package, or a file; %(default)s by default",
    )  # fmt: skip
    complete(scenario, completers.scenarios)
    if suite:
        game.add_argument(
            "--suite", action="store_true",
            help="all standard games of the package, and three_player with scaled costs",
        )  # fmt: skip
    return group


def add_seed(group: Group) -> None:
    """Add the number of the first run."""
    group.add_argument(
        "--seed", type=whole_number(0, 2**63 - 1), default=0, metavar="N",
        help="number of the run, or of the first of several runs; it determines all random "
        "numbers of a run; %(default)s by default",
    )  # fmt: skip


def add_samples(group: Group) -> None:
    """Add the number of samples of a study of equilibria."""
    group.add_argument(
        "--samples", type=whole_number(1), default=256, metavar="N",
        help="number of seeds to solve the game from; %(default)s by default",
    )  # fmt: skip


def add_runs(group: Group) -> None:
    """Add the number of runs of a study that plays runs."""
    group.add_argument(
        "--runs", type=whole_number(1), default=200, metavar="N",
        help="number of runs with each planner or predictor; %(default)s by default",
    )  # fmt: skip


def add_workers(parser: argparse.ArgumentParser) -> Group:
    """Add the group of options for the workers of a study."""
    group = parser.add_argument_group("workers")
    group.add_argument(
        "--jobs", type=whole_number(1, 1000), metavar="N",
        help="number of parallel runs on this machine; one per core by default",
    )  # fmt: skip
    group.add_argument(
        "--backend", choices=(PROCESSES, DASK), default=PROCESSES,
        help="processes on this machine, or the workers of a Dask cluster; %(default)s by default",
    )  # fmt: skip
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of the scheduler of the Dask cluster"
    )
    return group


def add_study(
    parser: argparse.ArgumentParser, add_count: Callable[[Group], None], *, suite: bool = False
) -> tuple[Group, Group, Group]:
    """Add the options of a study; returns the groups of its runs, workers and results."""
    game = add_game(parser, suite=suite)
    add_count(game)
    add_seed(game)
    return game, add_workers(parser), add_results(parser)


def add_results(parser: argparse.ArgumentParser) -> Group:
    """Add the group of options for the results."""
    group = parser.add_argument_group("results")
    out = group.add_argument(
        "--out", type=folder, metavar="DIR",
        help="folder for all results; a new one in results/ by default",
    )  # fmt: skip
    complete(out, completers.folders)
    group.add_argument(
        "--overwrite", action="store_true",
        help="delete the results of an earlier command in DIR; otherwise, they are refused, unless "
        "they are of the same study, which is resumed",
    )  # fmt: skip
    add_json(group)
    return group


def add_animation(group: Group) -> None:
    """Add the file of an animation."""
    group.add_argument(
        "--animation", type=animation_file, metavar="FILE",
        help="write an animation of the run to this .gif or .mp4 file; .mp4 requires ffmpeg",
    )  # fmt: skip


def add_json(group: Group) -> None:
    """Add the option for machine-readable output."""
    group.add_argument(
        "--json", action="store_true",
        help="print one JSON object on stdout, and everything else on stderr",
    )  # fmt: skip
