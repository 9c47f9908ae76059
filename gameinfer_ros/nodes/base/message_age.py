"""The age of messages on arrival."""

from collections import deque

#: Number of messages that the difference between the clocks is estimated from.
MANY = 50


class MessageAge:
    """Estimates the age of messages from the clocks of publisher and subscriber.

    The age matters because a publisher may send stored messages to late subscribers. The clocks
    may differ: the smallest delay of the last `MANY` messages is taken as their difference. The
    clocks are assumed to agree at first.
    """

    def __init__(self) -> None:
        self._delays = deque([0.0] * MANY, maxlen=MANY)

    def at(self, published: float, now: float) -> float:
        """Age of a message on arrival, in s, from its times of publication and arrival, in s."""
        self._delays.append(now - published)
        return self._delays[-1] - min(self._delays)
