"""Decides whether a node that died is restarted."""

import time
from collections import defaultdict, deque

from gameinfer_ros.names.defaults import RESPAWN_LIMIT, RESPAWN_WITHIN

#: Time for which a killed process may still count as a publisher, in s: the lease of Fast DDS, 20 s
#: with a user's profile, plus a margin for a busy machine.
LEASE = 30.0


class Respawn:
    """Counts the deaths of nodes; none is restarted unless this is `wanted`."""

    def __init__(self, wanted: bool) -> None:
        self._wanted = wanted
        self._deaths: defaultdict[str, deque[float]] = defaultdict(
            lambda: deque(maxlen=RESPAWN_LIMIT)
        )

    def allows(self, node: str) -> bool:
        """Whether a node that has just died may be restarted; if so, count its death."""
        now, deaths = time.monotonic(), self._deaths[node]
        if not self._wanted or (len(deaths) == RESPAWN_LIMIT and now - deaths[0] < RESPAWN_WITHIN):
            return False
        deaths.append(now)
        return True

    @property
    def ghosts(self) -> int:
        """Number of dead processes that may still count as publishers."""
        now = time.monotonic()
        return sum(now - t < LEASE for deaths in self._deaths.values() for t in deaths)
