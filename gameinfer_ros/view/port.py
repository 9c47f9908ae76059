"""Where the page of a run is found on this machine."""

from __future__ import annotations

import socket

from gameinfer_ros.names.defaults import VIEW_HOST, VIEW_PORT


def choose(wanted: int | None) -> int:
    """A port that is free now: the wanted one, any if that is 0, `VIEW_PORT` or any if it is None.

    Raises:
        ValueError: the wanted port cannot be used.
    """
    try:
        with socket.create_server((VIEW_HOST, VIEW_PORT if wanted is None else wanted)) as server:
            return int(server.getsockname()[1])
    except (OSError, OverflowError) as error:
        if wanted is None:
            return choose(0)
        raise ValueError(
            f"{wanted} is not allowed: it must be a port from 0 to 65535 that is not in use "
            f"({error})"
        ) from None


def answers(port: int) -> bool:
    """Whether somebody listens there."""
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((VIEW_HOST, port)) == 0
