"""Options of a run that depend on each other, on the scenario, or on this machine."""

import argparse
from pathlib import Path

from gameinfer_ros.inference import check_particles
from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.names.exit_codes import BAD_INPUT
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.runs.folder import BAG, contents
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.system import port as view_port


def choose_port(options: argparse.Namespace) -> None:
    """Choose the port of the page. Raises `RunError` if it is in use, or --view is missing."""
    if options.view:
        try:
            options.view_port = view_port.choose(options.view_port)
        except ValueError as error:
            raise RunError(f"--view-port: {error}", BAD_INPUT) from None
    elif options.view_port is not None or options.control:
        option = "--control" if options.control else "--view-port"
        raise RunError(
            f"{option} is not allowed without --view: only the live page uses it", BAD_INPUT
        )


def check_record(options: argparse.Namespace) -> None:
    """Check the folder of the bag. Raises `RunError`."""
    folder: Path | None = options.record
    if folder is None:
        return
    if options.out is not None and folder.resolve() == options.out.resolve():
        raise RunError(
            f"--record: '{folder}' is not allowed: it is the folder of --out; choose another one, "
            "which may be in it",
            BAD_INPUT,
        )
    try:
        if not folder.exists() or not any(folder.iterdir()):
            return
        if options.overwrite and contents(folder) == BAG:
            return
    except OSError:  # a file, or an unreadable folder
        pass
    raise RunError(
        f"--record: '{folder}' is not allowed: it must be a folder that does not exist yet or is "
        "empty; with --overwrite, it may contain an earlier bag",
        BAD_INPUT,
    )


def check_external(options: argparse.Namespace, scenario: Scenario) -> None:
    """Check the external players; by default, there are none. Raises `RunError`."""
    options.external = options.external or []
    players = scenario.game.players.names
    for name in options.external:
        if name not in players:
            raise RunError(
                f"--external: '{name}' is not allowed: the players are {', '.join(players)}",
                BAD_INPUT,
            )
    if options.external and options.time == LOCKSTEP:
        words = "requires --time realtime, because external players do not wait for steps"
        raise RunError(f"--external: {words}", BAD_INPUT)


def check_count(options: argparse.Namespace, scenario: Scenario) -> None:
    """Check that memory holds the particles. Raises `RunError`."""
    if options.particles is not None:
        try:
            check_particles(options.particles, scenario.game)
        except ValueError as error:
            raise RunError(f"--{error}", BAD_INPUT) from None
