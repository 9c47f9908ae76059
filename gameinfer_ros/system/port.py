"""Ports of this machine."""

import socket

from gameinfer_ros.names.defaults import VIEW_HOST, VIEW_PORT


def choose(wanted: int | None) -> int:
    """Choose a free port: `wanted`, or any if it is 0; if it is None, `VIEW_PORT` or else any.

    Raises:
        ValueError: the wanted port is invalid or in use.
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
    """Return whether a server listens on a port of this machine."""
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((VIEW_HOST, port)) == 0
