"""Options that several subcommands have: the same name, meaning and help wherever they stand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TypeAlias

from gameinfer_ros.commands.arguments import completers
from gameinfer_ros.commands.arguments.completers import complete
from gameinfer_ros.commands.arguments.types import animation_file, whole_number
from gameinfer_ros.names.choices import DASK, PROCESSES

#: Options under a heading of their own in the help.
Group: TypeAlias = argparse._ArgumentGroup


def add_bag(parser: argparse.ArgumentParser) -> None:
    """Add the folder of a bag."""
    bag = parser.add_argument_group("what is read").add_argument(
        "bag", type=Path, metavar="DIR", help="what gameinfer run --record DIR wrote"
    )
    complete(bag, completers.bags)


def add_game(parser: argparse.ArgumentParser) -> Group:
    """Add the group of options that say what is played, with `--scenario` in it."""
    group = parser.add_argument_group("what is played")
    scenario = group.add_argument(
        "--scenario", default="three_player", metavar="NAME-or-FILE",
        help="a scenario of the package or a file; %(default)s by default",
    )  # fmt: skip
    complete(scenario, completers.scenarios)
    return group


def add_seed(group: Group) -> None:
    """Add the number of a run."""
    group.add_argument(
        "--seed", type=whole_number(0, 2**63 - 1), default=0, metavar="N",
        help="number of the run, or of the first of several, which all its random numbers come "
        "of; %(default)s by default",
    )  # fmt: skip


def add_samples(group: Group) -> None:
    """Add the size of a study of equilibria."""
    group.add_argument(
        "--samples", type=whole_number(1), default=256, metavar="N",
        help="seeds to solve the game from; %(default)s by default",
    )  # fmt: skip


def add_runs(group: Group) -> None:
    """Add the size of a study that plays runs."""
    group.add_argument(
        "--runs", type=whole_number(1), default=200, metavar="N",
        help="runs, of each planner or predictor; %(default)s by default",
    )  # fmt: skip


def add_workers(parser: argparse.ArgumentParser) -> Group:
    """Add the group of options that say who makes the runs of a study."""
    group = parser.add_argument_group("who makes the runs")
    group.add_argument(
        "--jobs", type=whole_number(1, 1000), metavar="N",
        help="runs to make at once on this machine; one for each core by default",
    )  # fmt: skip
    group.add_argument(
        "--backend", choices=(PROCESSES, DASK), default=PROCESSES,
        help="processes of this machine, or the workers of a Dask cluster; %(default)s by default",
    )  # fmt: skip
    group.add_argument("--scheduler", metavar="ADDRESS", help="of the Dask cluster")
    return group


def add_results(parser: argparse.ArgumentParser) -> Group:
    """Add the group of options that say where results go."""
    group = parser.add_argument_group("results")
    out = group.add_argument(
        "--out", type=Path, metavar="DIR",
        help="folder for all results; by default a new one in results/",
    )  # fmt: skip
    complete(out, completers.folders)
    add_json(group)
    return group


def add_animation(group: Group) -> None:
    """Add the file for an animation."""
    group.add_argument(
        "--animation", type=animation_file, metavar="FILE",
        help="draw the run as an animation into this .gif file, or .mp4 file if there is ffmpeg",
    )  # fmt: skip


def add_json(group: Group) -> None:
    """Add the option for readers that are programs."""
    group.add_argument("--json", action="store_true", help="print one JSON object as last line")
