"""Options of a run that depend on one another, on the scenario, or on this machine."""

from __future__ import annotations

import argparse

from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.view import port as view_port


class OptionError(ValueError):
    """Options do not go together or cannot be used; the message says which, and why."""


def choose_port(options: argparse.Namespace) -> None:
    """Settle where the run can be viewed.

    Raises:
        OptionError: the port cannot be used, or an option lacks --view.
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
    """Check who is external: by default, nobody.

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
        raise OptionError("--external: needs --time realtime, because nobody else waits for steps")
