"""ROS domains for tests that run beside others."""

from __future__ import annotations

import os
import random
import socket

#: Tests that run in another process at the same time have other domains.
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_OWN = range(1 + _WORKER, 101, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
_domains = random.SystemRandom().sample(_OWN, len(_OWN))


def free_domain() -> int:
    """A domain that was not given before, and that nobody on this machine is in, by its ports."""
    while _domains:
        domain = _domains.pop()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:  # the port at which the first participant of a domain is found
                probe.bind(("0.0.0.0", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain
    _domains.extend(random.SystemRandom().sample(_OWN, len(_OWN)))  # from the start again
    return free_domain()
