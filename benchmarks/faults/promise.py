"""What is promised of every run, whatever goes wrong."""

from __future__ import annotations

#: An input comes from a state at most so many steps old (`brake_after`), and from a strategy at
#: most so many (`max_strategy_age`).
STATE_AGE, STRATEGY_AGE = 5, 10

#: A robot that hears no new states, or whose inputs nobody hears, stands after so many steps, and
#: one that hears no new strategies after so many.
STANDS_AFTER, STANDS_WITHOUT_STRATEGIES_AFTER = 15, 20

#: A base that is told velocities is told to stand after so long without a state, in s.
BASE_STANDS_AFTER = 1.5

#: Steps after its start until an inference publishes what it has made of all states so far: 3 s
#: for the discovery of others and the lease of the one before it, and eight steps.
REBUILT_AFTER = 38


class BrokenPromiseError(AssertionError):
    """What was promised is not what happened."""


def promise(holds: object, what: str) -> None:
    """Raise an exception if a promise does not hold."""
    if not holds:
        raise BrokenPromiseError(what)
