"""How old messages are."""

from __future__ import annotations

from collections import deque

#: If so many messages in a row seem to have been under way for long, clocks do not agree.
MANY = 50


class MessageAge:
    """Tells how long ago messages were published, by the clocks of two machines.

    What a publisher has kept for those who join late is old when it arrives; only its stamp tells.
    Clocks are taken to agree, until the last `MANY` messages say otherwise: none of them can have
    been under way for less than no time, and not all of them for long.
    """

    def __init__(self) -> None:
        self._delays = deque([0.0] * MANY, maxlen=MANY)

    def at(self, published: float, now: float) -> float:
        """How old a message is at its arrival.

        Args:
            published: when it was published, in s, by the clock of who did.
            now: when it arrived, in s, by our clock.
        """
        self._delays.append(now - published)
        return self._delays[-1] - min(self._delays)
