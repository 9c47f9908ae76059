"""ROS domains for tests that run beside others."""

from __future__ import annotations

import random
import socket

_domains = random.SystemRandom().sample(range(1, 101), 100)


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
    _domains.extend(random.SystemRandom().sample(range(1, 101), 100))  # from the start again
    return free_domain()
