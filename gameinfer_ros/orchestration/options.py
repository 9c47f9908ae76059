"""Options of a run that depend on one another, on the scenario, or on this machine."""

from __future__ import annotations

import argparse

from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.view import port as view_port


class OptionError(ValueError):
    """Options are invalid or exclude each other. The message says which, and why."""


def choose_port(options: argparse.Namespace) -> None:
    """Choose the port of the page.

    Raises:
        OptionError: the port is invalid or in use, or an option requires --view.
    """
    if options.view:
        try:
            options.view_port = view_port.choose(options.view_port)
        except ValueError as error:
            raise OptionError(f"--view-port: {error}") from None
    elif options.view_port is not None or options.control:
        option = "--control" if options.control else "--view-port"
        raise OptionError(f"{option} is not allowed without --view: it is about the page")


def check_external(options: argparse.Namespace, scenario: Scenario) -> None:
    """Check the external players; by default, there are none.

    Raises:
        OptionError: a player is unknown, or the time is lockstep.
    """
    options.external = options.external or []
    players = scenario.game.players.names
    for name in options.external:
        if name not in players:
            raise OptionError(
                f"--external: '{name}' is not allowed: the players are {', '.join(players)}"
            )
    if options.external and options.time == LOCKSTEP:
        raise OptionError(
            "--external: needs --time realtime, because external players do not wait for steps"
        )
