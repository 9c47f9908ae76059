"""ROS domains for tests that run beside others."""

from __future__ import annotations

import itertools
import os
import random
import socket

#: Tests that run in another process at the same time have other domains.
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_OWN = range(1 + _WORKER, 101, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
#: In the same order again and again: what has just been used comes last.
_domains = itertools.cycle(random.SystemRandom().sample(_OWN, len(_OWN)))


def free_domain() -> int:
    """A domain that no process of this machine is in, by its ports; the least recently used one.

    Raises:
        RuntimeError: all are taken.
    """
    for domain in itertools.islice(_domains, len(_OWN)):
        # Participants of a domain listen at these ports.
        if all(_is_free(7400 + 250 * domain + 10 + 2 * number) for number in range(32)):
            return domain
    raise RuntimeError("all domains that these tests may use are taken")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return False
        return True
